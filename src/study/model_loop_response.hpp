#pragma once

#include <flyball/study/design_model.hpp>

namespace flyball::study {

/// The loop of a model's regulator opened at each of its inputs in turn, the others closed,
/// 1 + L_i = det(I + L)/det(I + L of the others): from a thousandth of Nyquist's frequency to it.
/// None of a model that is too large for a picture, or whose loop cannot be told.
[[nodiscard]] std::vector<std::vector<FrequencyPoint>> loop_responses(
    const ModelRegulator& regulator, Time delay);

}  // namespace flyball::study
