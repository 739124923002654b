#pragma once

#include <string>
#include <string_view>

#include <flyball/control/mpc/linear_mpc.hpp>

namespace flyball::exports {

/// A C++17 header, without Flyball or Eigen, of the namespace `mpc`: its `Controller` is the
/// predictive controller with its plant, weights, limits and horizon,
///
///     mpc::Controller controller;
///     controller.set_reference(r, u_r);
///     controller.calculate(x, u);   // arrays of `mpc::states` and `mpc::inputs` numbers
///
/// by the library's own method and with its numbers to rounding. It neither allocates nor throws;
/// an object holds all of its memory. @param mpc  As it was made; references are not in it.
/// @param origin  What it was made from, for a comment.
/// Cost: linear in the matrices' entries.
[[nodiscard]] std::string linear_mpc_header(const detail::MpcCore& mpc, std::string_view origin);
template <int States, int Inputs>
[[nodiscard]] std::string linear_mpc_header(const LinearMpc<States, Inputs>& mpc,
                                            std::string_view origin) {
  return linear_mpc_header(mpc.core(), origin);
}

}  // namespace flyball::exports
