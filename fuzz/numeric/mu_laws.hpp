#pragma once

#include <vector>

#include <nlohmann/json.hpp>

#include "numeric/laws.hpp"

namespace flyball::fuzz {

/// What holds of bounds of a structured singular value: the lower is no more than the upper; the
/// scalings prove the upper one, exactly; Δ has its structure and size, and I - M Δ is singular; no
/// bound is far above the Frobenius norm.
[[nodiscard]] std::vector<Verdict> mu_verdicts(const nlohmann::json& problem,
                                               const nlohmann::json& answer);

}  // namespace flyball::fuzz
