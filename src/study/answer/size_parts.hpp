#pragma once

#include <string>
#include <vector>

#include <flyball/study/size.hpp>

/// Pieces of the answer of `flyball size`.
namespace flyball::study {

/// The time and its cost against the gearing; the motion; the sweeps.
[[nodiscard]] std::vector<Figure> figures_of(const SizeResult& result);

/// Of what moves: "m" or "rad", and of its speed.
[[nodiscard]] std::string way_unit(const SizeResult& result);
[[nodiscard]] std::string speed_unit(const SizeResult& result);

/// "1.2 m, from rest to rest": the motion in words.
[[nodiscard]] std::string motion_in_words(const SizeResult& result);

/// Of all pictures over the motion's time.
inline constexpr const char* size_clock = "motion";

}  // namespace flyball::study
