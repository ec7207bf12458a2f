# lbea_debian_source(<archive> <package> <folder> <sha1> <sha256>): downloads Debian's source archive, if it is absent: from
# the mirror that apt uses for the package, with apt's proxies, or from Debian's pool/main/<folder>. Stops the configuration
# when the file is another one.
function(lbea_debian_source archive package folder sha1 sha256)
  if(NOT EXISTS ${archive})
    cmake_path(GET archive FILENAME name)
    cmake_path(GET archive PARENT_PATH parent)
    execute_process(COMMAND apt-get --print-uris download ${package} OUTPUT_VARIABLE printed ERROR_QUIET)
    set(mirror)
    if(printed MATCHES "'(http[^']*/)${package}[^/]*'")
      set(mirror ${CMAKE_MATCH_1}${name})
    endif()
    execute_process(COMMAND ${CMAKE_COMMAND} -E make_directory ${parent} ERROR_QUIET)  # a tree may be read-only
    foreach(url ${mirror} http://deb.debian.org/debian/pool/main/${folder}/${name} https://snapshot.debian.org/file/${sha1})
      execute_process(COMMAND /usr/lib/apt/apt-helper -o Acquire::Retries=0 -o Acquire::http::Timeout=10
                              download-file ${url} ${archive} SHA256:${sha256}
                      OUTPUT_QUIET ERROR_QUIET)
      if(EXISTS ${archive})
        break()
      endif()
    endforeach()
  endif()
  if(EXISTS ${archive})
    file(SHA256 ${archive} found)
    if(NOT found STREQUAL sha256)
      message(FATAL_ERROR "${archive} is not Debian's source archive: delete it and configure again")
    endif()
  endif()
endfunction()
