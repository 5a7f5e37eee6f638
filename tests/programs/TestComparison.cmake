# Runs compare_programs on sample/, of which is known what it has to say.
file(REMOVE_RECURSE ${WORK})
execute_process(COMMAND ${CMAKE_COMMAND} -E env CXX=${COMPILER} ${SOURCE}/compare_programs ${SOURCE}/sample --build ${BUILD}
        --simbody ${SIMBODY} --work ${WORK} --limit 5
    RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(NOT status EQUAL 0)
    message(FATAL_ERROR "compare_programs failed (${status}):\n${output}")
endif()
foreach(line IN ITEMS "Endless +agrees .* in 8 states; as exact at accuracy 1e-0[0-9]" "NoMotion +agrees .* no integrator" "Reference +agrees .*\\(IntegratorRef\\).* in 3 states"
        "Wrong +wrong .* start 0e\\+00, error [0-9]" "Crash +crashed .*no such thing" "Stuck +stopped"
        [["programs": 6, "with_integrator": 5, "built": 6, "with_ref": 1, "agree": 3, "wrong": 1, "crashed": 1, "refused": 0, "stopped": 1, "no_reference": 0]])
    if(NOT output MATCHES "${line}")
        message(FATAL_ERROR "not said: ${line}\n${output}")
    endif()
endforeach()
