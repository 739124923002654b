#pragma once

#include <cstddef>

/// What several answers call thin, poor or too many.
namespace flyball::study {

inline constexpr double thin_gain_margin = 1.7;  ///< Below the classical rules of thumb 2 and 30°.
inline constexpr double thin_phase_margin = 30.0;  ///< deg
inline constexpr double poor_fit = 0.9;            ///< R² below which the overlay deserves a look.
inline constexpr std::size_t most_panels = 8;      ///< Of a picture that is looked at.
inline constexpr const char* not_used = "not used by the fit";

}  // namespace flyball::study
