#include "io/sysid_rows.hpp"

namespace flyball::io {

std::string without_nan_words(std::string_view text) {
  std::string result(text);
  bool quoted = false;
  for (std::size_t i = 0; i < result.size(); ++i) {
    if (result[i] == '"') {
      quoted = !quoted;
    } else if (quoted) {
      i += result[i] == '\\' ? 1 : 0;
    } else {
      for (const std::string_view word :
           {"NaN", "-Infinity", "Infinity", "-NaN", "nan", "inf", "-inf"}) {
        if (result.compare(i, word.size(), word) == 0) {
          result.replace(i, word.size(), word.size(), ' ');
          result[i] = '"';
          result[i + 1] = '"';
          i += word.size() - 1;
          break;
        }
      }
    }
  }
  return result;
}

}  // namespace flyball::io
