# The key reference of the guide is what the program prints; if not, this says how to print it anew.
execute_process(COMMAND ${PROGRAM} keys --markdown OUTPUT_VARIABLE printed COMMAND_ERROR_IS_FATAL ANY)
file(READ ${PAGE} page)
string(STRIP "${printed}" printed)
string(FIND "${page}" "${printed}" place)
if(place EQUAL -1)
    message(FATAL_ERROR "${PAGE} is not up to date: tests/guide/update_keys.sh ${PROGRAM}")
endif()
