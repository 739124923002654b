#pragma once

#include <Eigen/Core>

namespace flyball::detail {

/// Whether the library has compiled its run-time class templates for these sizes.
template <int... Sizes>
inline constexpr bool shipped = false;

#define FLYBALL_STATES_INPUTS(States, Inputs) \
  template <>                                 \
  inline constexpr bool shipped<States, Inputs> = true;
#define FLYBALL_STATES_INPUTS_OUTPUTS(States, Inputs, Outputs) \
  template <>                                                  \
  inline constexpr bool shipped<States, Inputs, Outputs> = true;
#include <flyball/core/instantiated_sizes.inc>

/// Whether members of these sizes will be found: in the library, or in a .tpp that was included
/// before, which completes `Definitions`. Asked by a class when it is first used.
template <class Definitions, int... Sizes>
concept has_definitions = shipped<Sizes...> || requires { sizeof(Definitions); };

}  // namespace flyball::detail
