#pragma once

#include <vector>

#include <flyball/core/animation.hpp>
#include <flyball/core/figure.hpp>
#include <flyball/study/path.hpp>

/// Pictures of a path.
namespace flyball::study {

[[nodiscard]] std::vector<Figure> path_figures(const PathResult& result);
[[nodiscard]] Animation path_animation(const PathResult& result);

}  // namespace flyball::study
