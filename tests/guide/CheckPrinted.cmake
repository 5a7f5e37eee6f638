# PAGE of the guide contains what the command ARGUMENTS of PROGRAM prints; if not, this says how to print it anew.
separate_arguments(ARGUMENTS UNIX_COMMAND "${ARGUMENTS}")
execute_process(COMMAND ${PROGRAM} ${ARGUMENTS} OUTPUT_VARIABLE printed COMMAND_ERROR_IS_FATAL ANY)
file(READ ${PAGE} page)
string(STRIP "${printed}" printed)
string(FIND "${page}" "${printed}" place)
if(place EQUAL -1)
    message(FATAL_ERROR "${PAGE} is not up to date: run tests/guide/update_printed.sh ${PROGRAM}")
endif()
