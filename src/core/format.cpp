#include "core/format.hpp"

#ifndef FLYBALL_WITHOUT_FMT

namespace flyball::detail {

std::string format_arguments(fmt::string_view pattern, fmt::format_args arguments) {
  return fmt::vformat(pattern, arguments);
}

}  // namespace flyball::detail

#endif
