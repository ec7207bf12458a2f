# For Doxygen: a comment behind code belongs to that code, and goes on in the comment-only lines indented below it.
/[^ \/].*[;,{)] *\/\/ / && !/^ *\/\// { sub(/ \/\/ /, " ///< "); behind = 1; print; next }
behind && /^ {20,}\/\/ /             { sub(/\/\/ /, "///< "); print; next }
                                     { behind = 0; print }
