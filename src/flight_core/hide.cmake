# cmake -DOBJECT=... -DSEEN=... -DNM=... -DOBJCOPY=... -P hide.cmake: leaves OBJECT's symbols that SEEN lists global and
# makes all others local.
#
# objcopy does not make local what the compiler marked as unique in the process; weakened first, it is as any other.
function(run)
  execute_process(COMMAND ${ARGN} OUTPUT_VARIABLE output RESULT_VARIABLE status)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "failed (${status}): ${ARGN}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

run(${NM} --defined-only ${OBJECT})
string(REGEX MATCHALL "[0-9a-f]+ u [^\n]+" unique "${output}")
list(TRANSFORM unique REPLACE "^[0-9a-f]+ u " "")
string(REPLACE ";" "\n" unique "${unique}")
file(WRITE ${OBJECT}.unique "${unique}\n")
run(${OBJCOPY} --weaken-symbols=${OBJECT}.unique ${OBJECT})
run(${OBJCOPY} --keep-global-symbols=${SEEN} ${OBJECT})
