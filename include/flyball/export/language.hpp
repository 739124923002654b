#pragma once

#include <array>

namespace flyball::exports {

/// A language that robot code is written in.
enum class Language {
  cpp,     ///< C++17.
  java,    ///< Java 11.
  python,  ///< Python 3.8.
};
inline constexpr std::array languages{Language::cpp, Language::java, Language::python};

}  // namespace flyball::exports
