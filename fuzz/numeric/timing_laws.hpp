#pragma once

#include <vector>

#include "numeric/laws.hpp"

namespace flyball::fuzz {

/// Of a motion along a curve: limits hold to 1e-9 at every sample and between them, and times and
/// parameters ascend.
[[nodiscard]] std::vector<Verdict> timing_verdicts(const nlohmann::json& problem,
                                                   const nlohmann::json& answer);

}  // namespace flyball::fuzz
