#pragma once

#include <string_view>

/// The predictive controller's method as text: what the library compiles stands in headers, too.
namespace flyball::exports {

extern const std::string_view mpc_program_text;
extern const std::string_view mpc_method_text;

}  // namespace flyball::exports
