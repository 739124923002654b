#pragma once

#include <complex>
#include <string_view>
#include <vector>

#include <flyball/classical/frequency_response.hpp>

namespace flyball::classical {

/// A piece of a loop that is not linear, and what a sine makes of it.
enum class NonlinearityKind {
  saturation,  ///< slope·x up to |x| = width, constant beyond.
  dead_zone,   ///< Zero up to |x| = width, slope·(x ∓ width) beyond.
  relay,       ///< height·sign x.
  hysteresis,  ///< A relay that switches at ±width, beyond zero.
  backlash,    ///< slope·(x ∓ width): gears with a gap of 2 width in all.
};
/// "saturation", "dead-zone", "relay", "hysteresis", "backlash".
[[nodiscard]] std::string_view to_string(NonlinearityKind kind);
/// @errors ArgumentError::unknown_name with the nearest name as hint.
[[nodiscard]] Expected<NonlinearityKind> parse_nonlinearity(std::string_view name);

/// A nonlinearity without memory, or with one of one side, and its measures.
struct Nonlinearity {
  NonlinearityKind kind = NonlinearityKind::saturation;
  double width = 1.0;   ///< In the unit of its input; of a relay not asked for.
  double slope = 1.0;   ///< Of saturation, dead zone and backlash.
  double height = 1.0;  ///< Of relay and hysteresis, in the unit of the output.
};

/// N(a): the first harmonic of the answer to a sin ωt, as a complex gain; none of a hysteresis or a
/// backlash that the sine does not move.
/// @errors ArgumentError::not_positive for the amplitude, width, slope or height.
/// Source: Gelb and Vander Velde, "Multiple-Input Describing Functions" (1968), appendix B.
[[nodiscard]] Expected<std::optional<std::complex<double>>> describing_function(
    const Nonlinearity& nonlinearity, double amplitude);

/// An oscillation that keeps itself up.
struct LimitCycle {
  double amplitude = 0.0;  ///< Of the sine at the nonlinearity's input.
  double frequency = 0.0;  ///< rad/s
  bool stable = false;     ///< Whether one that is a little larger shrinks (Loeb's criterion).
};

/// Where L(jω) N(a) = -1: the oscillations that the first harmonic predicts of the loop of a
/// nonlinearity and L under negative feedback, by frequency. They are as true as L is a low pass.
/// @param loop  L, one input, one output; its grid (`frequency_grid`) is searched.
/// @errors ArgumentError as above and for the loop; those of `frequency_grid`.
/// Source: Gelb and Vander Velde, chapters 3 and 4; Loeb, Annales de Télécommunications (1956).
[[nodiscard]] Expected<std::vector<LimitCycle>> limit_cycles(const FrequencyResponse& loop,
                                                             const Nonlinearity& nonlinearity);

}  // namespace flyball::classical
