#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/math/expression/tape.hpp>

namespace flyball::exports {

/// The numbers of a swing-up and balance of one input.
struct SwingUpProgram {
  std::string origin{};               ///< The project file, for a comment.
  std::vector<std::string> states{};  ///< Names with units, for comments.
  Eigen::VectorXd x{};                ///< n
  double u = 0.0;
  double limit = 0.0;      ///< Largest size of the input.
  Eigen::RowVectorXd K{};  ///< n
  Eigen::MatrixXd P{};     ///< n x n
  double level = 0.0;
  double leave = 0.0;
  std::vector<bool> angles{};  ///< n
  expression::Tape law{};      ///< From [x; u] to the energy and what the input does to it.
  std::vector<double> parameters{};
  double energy = 0.0;
  double scale = 0.0;
  double sharpness = 0.0;
  Eigen::RowVectorXd hold{};  ///< n
};

/// A C++17 header that runs it, without Flyball: `swing_up::Controller`.
/// @errors Those of `source_text`.
[[nodiscard]] Expected<std::string> swing_up_header(const SwingUpProgram& program);

}  // namespace flyball::exports
