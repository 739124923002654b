#pragma once

#include <vector>

#include <flyball/core/animation.hpp>
#include <flyball/core/figure.hpp>
#include <flyball/study/plan.hpp>

namespace flyball::study {

/// The space with the path, of two axes; what each axis could do along the way, of any number; the
/// motion in time.
[[nodiscard]] std::vector<Figure> plan_figures(const PlanResult& result);

/// The mechanism as it moves, among its obstacles.
[[nodiscard]] std::vector<Animation> plan_animation(const PlanResult& result);

}  // namespace flyball::study
