# Makes the Debian package of BUILD, unpacks it into WORK/unpacked, runs the program that is in it, and builds and runs
# pendulum/ with it.
include(${CMAKE_CURRENT_LIST_DIR}/Run.cmake)

file(REMOVE_RECURSE ${WORK})
# What is built is packed: another generator's name keeps CPack from building first.
file(MAKE_DIRECTORY ${WORK})
run(${CPACK} --config ${BUILD}/CPackConfig.cmake -B ${WORK} -D CPACK_CMAKE_GENERATOR=Ninja)
file(GLOB package ${WORK}/*.deb)
run(dpkg-deb --extract ${package} ${WORK}/unpacked)

run(dpkg-deb --field ${package} Depends)
foreach(library IN ITEMS libsimbody3.7 libhdf5 libstdc\\+\\+6)
    if(NOT output MATCHES "${library}")
        message(FATAL_ERROR "the package does not depend on ${library}: ${output}")
    endif()
endforeach()
run(dpkg-deb --info ${package} triggers)
if(LINTIAN)
    run(${LINTIAN} --allow-root --fail-on error,warning ${package})
endif()

set(ENV{LD_LIBRARY_PATH} "")
run(${WORK}/unpacked/usr/bin/simflex --version)
run(${WORK}/unpacked/usr/bin/simflex --help)
# Every command has its place in the man page.
string(REGEX MATCHALL "\n  [a-z]+ " commands "${output}")
file(GLOB page ${WORK}/unpacked/usr/share/man/man1/simflex.1.gz)
run(gzip -dc ${page})
foreach(command IN LISTS commands)
    string(STRIP ${command} command)
    if(NOT output MATCHES "\n\\.B ${command}\n")
        message(FATAL_ERROR "simflex.1 does not know the command ${command}")
    endif()
endforeach()
foreach(file IN ITEMS guide/README.md models/ruler.yaml models/ruler.geo parts/crank.geo short/stress.cpp copyright)
    if(NOT EXISTS ${WORK}/unpacked/usr/share/doc/simflex/${file})
        message(FATAL_ERROR "the package lacks share/doc/simflex/${file}")
    endif()
endforeach()

run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR}/pendulum -B ${WORK}/build -D CMAKE_BUILD_TYPE=Release
    -D CMAKE_CXX_COMPILER=${COMPILER} -D CMAKE_PREFIX_PATH=${WORK}/unpacked/usr)
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/pendulum ${BUILD}/parts/rod.h5)
if(NOT output MATCHES "fell by 0\\.39[0-9] rad")
    message(FATAL_ERROR "the pendulum: ${output}")
endif()
