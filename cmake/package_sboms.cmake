# Run by CPack between staging and packing: a bill of materials into each package.
function(add_sbom component package target)
  set(folder ${CPACK_TEMPORARY_DIRECTORY}/${component}/usr/share/doc/${package})
  execute_process(COMMAND ${CPACK_BERTH_MAKE_SBOM} ${CPACK_BERTH_BUILD} ${target} ${folder}/sbom.cdx.json
                          --name ${package} --version ${CPACK_PACKAGE_VERSION}
                  RESULT_VARIABLE status ERROR_VARIABLE error)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "no bill of materials for ${package} (${status}): ${error}")
  endif()
endfunction()
add_sbom(runtime libberth0 ${CPACK_BERTH_LIBRARY})
add_sbom(dev libberth-dev libberth_cpp.a)
add_sbom(tools berth berth)
