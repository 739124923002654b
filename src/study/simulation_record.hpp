#pragma once

#include <flyball/study/simulate.hpp>

namespace flyball::study {

/// How many steps there are, if rows of so many columns can be recorded.
/// @errors ArgumentError::out_of_range.
[[nodiscard]] Expected<Eigen::Index> steps_of(double duration, double step, Eigen::Index columns);

/// Fills in what the record says of states, outputs and inputs.
void summarize(Simulation& result);

}  // namespace flyball::study
