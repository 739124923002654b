#pragma once

#include <string>

#include <flyball/core/animation.hpp>
#include <flyball/core/figure.hpp>

namespace flyball::report {

/// A figure for the page's scripts (page/plots.js), as JSON that may stand in a <script> element.
/// Columns that several curves share are in it once; each is a base in double and differences from
/// it in single precision, little-endian in base64, a third of the size of text.
[[nodiscard]] std::string plot_data(const Figure& figure);

/// An animation for page/animation.js, in the same form.
[[nodiscard]] std::string animation_data(const Animation& animation);

}  // namespace flyball::report
