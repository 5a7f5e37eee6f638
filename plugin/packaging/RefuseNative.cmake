# Read by CPack in builds with SIMFLEX_NATIVE: their programs die on processors that know less than this machine's.
message(FATAL_ERROR "this build uses every instruction of this machine's processor; package what the preset `portable` has built:
  cmake --preset portable && cmake --build --preset portable && cpack --config build/portable/CPackConfig.cmake")
