#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <flyball/solve/kind.hpp>

namespace flyball::fuzz {

/// A law that an answer was held against, and by how much it does not hold: the backward error,
/// what is left of the equation beside its largest term.
struct Verdict {
  std::string law;
  double defect = 0.0;
};

/// The largest defect of a success.
inline constexpr double tolerance = 1e-10;

/// Everything that is checked of a success: that its numbers are finite where the kind's row says
/// so, and in 113 bits the equations that the kind solves.
[[nodiscard]] std::vector<Verdict> check_answer(const solve::Kind& kind,
                                                const nlohmann::json& problem,
                                                const nlohmann::json& answer);

}  // namespace flyball::fuzz
