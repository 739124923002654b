#pragma once

#include "study/toml_document.hpp"

namespace flyball::study {

/// What [estimate] says of a model. What is wrong with it is kept by the document.
/// @param x  n, where states start that it says nothing of.
[[nodiscard]] ModelEstimate model_estimate(TomlDocument& document, const Project& project,
                                           const AnyModel& model, const Eigen::VectorXd& x);

}  // namespace flyball::study
