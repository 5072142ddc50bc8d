# berth_optional(NAME FOUND WHAT NEEDS REMEDY): the option BERTH_WITH_NAME, on where what it needs is FOUND. Asked for where
# it is not, it ends the configuration with the REMEDY; left out, it says so.
function(berth_optional name found what needs remedy)
  option(BERTH_WITH_${name} "Build ${what} (needs ${needs})" ${found})
  if(BERTH_WITH_${name} AND NOT found)
    message(FATAL_ERROR "BERTH_WITH_${name} needs ${needs}: ${remedy}, or build with -DBERTH_WITH_${name}=OFF")
  elseif(NOT BERTH_WITH_${name})
    message(STATUS "Without ${what}: it needs ${needs}; ${remedy}, and set -DBERTH_WITH_${name}=ON")
  endif()
endfunction()
