# What the toolchains have in common. Libraries are the target's; xxHash, Eigen, nanoflann and doctest are headers only,
# and the build machine's are used, after all folders of the target.
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_C_FLAGS_INIT "-idirafter /usr/include")
set(CMAKE_CXX_FLAGS_INIT "-idirafter /usr/include")
