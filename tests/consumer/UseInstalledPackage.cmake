# Installs BUILD into WORK/prefix, then configures, builds and runs project/ against it.
include(${CMAKE_CURRENT_LIST_DIR}/Run.cmake)

file(REMOVE_RECURSE ${WORK}/prefix ${WORK}/build)
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
file(GLOB_RECURSE headers ${WORK}/prefix/include/*.h)
foreach(header IN LISTS headers)
    file(STRINGS ${header} eigen REGEX "# *include *[<\"]Eigen")
    if(eigen)
        message(FATAL_ERROR "${header} includes Eigen: ${eigen}")
    endif()
endforeach()
run(${WORK}/prefix/bin/simflex --version)

# The programs in README.md: the model that was installed, and the C++ program on the part it reduces.
set(README_RUN ${WORK}/readme)
file(REMOVE_RECURSE ${README_RUN})
file(COPY ${WORK}/prefix/share/doc/simflex/models/ruler.geo ${WORK}/prefix/share/doc/simflex/models/ruler.yaml
    DESTINATION ${README_RUN})
run(${CMAKE_COMMAND} -E env SIMFLEX_CACHE=${WORK}/cache
    ${CMAKE_COMMAND} -E chdir ${README_RUN} ${WORK}/prefix/bin/simflex run ruler.yaml --only rest --no-pictures)
file(READ ${CMAKE_CURRENT_LIST_DIR}/../../README.md readme)
if(NOT readme MATCHES "```cpp\n([^`]*)```")
    message(FATAL_ERROR "README.md has no C++ example")
endif()
file(WRITE ${WORK}/readme.cpp "${CMAKE_MATCH_1}")
run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR}/project -B ${WORK}/build -D CMAKE_BUILD_TYPE=Release
    -D CMAKE_CXX_COMPILER=${COMPILER} -D CMAKE_PREFIX_PATH=${WORK}/prefix
    -D README_PROGRAM=${WORK}/readme.cpp)
run(${CMAKE_COMMAND} --build ${WORK}/build --parallel 2)
run(${WORK}/build/consumer ${WORK}/consumer.h5)
run(${CMAKE_COMMAND} -E chdir ${README_RUN} ${WORK}/prefix/bin/simflex reduce ruler.geo --material steel --mesh-size 0.01
    -i held=HELD --master held=0,0,0 -i free=FREE --master free=0.3,0,0 -o ruler.h5)
run(${CMAKE_COMMAND} -E chdir ${README_RUN} ${WORK}/build/readme_program)
# It falls from its undeformed shape: at most to twice the deflection of a cantilever, q L⁴/8EI = 1.11 mm.
if(NOT output MATCHES "y = -2\\.2")
    message(FATAL_ERROR "the ruler: ${output}")
endif()
