# Doxygen filter: marks trailing comments, and their indented continuation lines, as documentation of the code before them.
/[^ \/].*[;,{)] *\/\/ / && !/^ *\/\// { sub(/ \/\/ /, " ///< "); behind = 1; print; next }
behind && /^ {20,}\/\/ /             { sub(/\/\/ /, "///< "); print; next }
                                     { behind = 0; print }
