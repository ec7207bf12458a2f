include(${CMAKE_CURRENT_LIST_DIR}/lbea-targets.cmake)
