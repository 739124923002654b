# cmake -D OUTPUT=<file.cpp> -D ITEMS=<items.csv> -D REFERENCES=<a.json|b.json…> -P
# embed_references.cmake
#
# Puts the list of the book's items and the reference files into a source, so that the library finds
# them wherever it runs.
string(REPLACE "|" ";" REFERENCES "${REFERENCES}")
set(literals "")
foreach(file IN LISTS REFERENCES)
  file(READ "${file}" json)
  string(APPEND literals "    R\"reference(${json})reference\",\n")
endforeach()
file(READ "${ITEMS}" items)
file(
  WRITE "${OUTPUT}"
  "#include <array>

#include \"book/reference.hpp\"

namespace flyball::book {

namespace {

constexpr auto references = std::to_array<std::string_view>({
${literals}});

}  // namespace

std::span<const std::string_view> embedded_references() {
  return references;
}

std::string_view book_items() {
  return R\"items(${items})items\";
}

}  // namespace flyball::book
")
