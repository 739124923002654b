# cmake -DOUTPUT=<file.cpp> -DHEADER=<"header.hpp"> -DNAMESPACE=<a::b> "-DTEXTS=name=file[+file...];..."
# -P EmbedText.cmake: each name becomes a std::string_view of its files' contents, one after the
# other.

set(source "// Made by cmake/EmbedText.cmake.\n#include \"${HEADER}\"\n\nnamespace ${NAMESPACE} {\n")
foreach(entry IN LISTS TEXTS)
  string(REGEX MATCH "^([a-z_]+)=(.+)$" matched "${entry}")
  set(name ${CMAKE_MATCH_1})
  string(REPLACE "+" ";" files "${CMAKE_MATCH_2}")
  string(APPEND source "\nconst std::string_view ${name} =")
  foreach(file IN LISTS files)
    file(READ "${file}" text)
    string(APPEND source "\n    R\"flyball_text(${text})flyball_text\"")
  endforeach()
  string(APPEND source ";\n")
endforeach()
file(WRITE "${OUTPUT}" "${source}\n}  // namespace ${NAMESPACE}\n")
