#pragma once

#include <string>
#include <utility>
#include <vector>

#include <flyball/systems/system.hpp>

#include "book/drawing.hpp"

/// The case studies of sections 7.7.4, 7.8.1, C.1 and C.2: a CIM motor with inductance, from rest
/// to 209.4 rad/s at once.
namespace flyball::book {

/// dω/dt = -b/J ω + K_t/J i, di/dt = -K_e/L ω - R/L i + u/L (section 6.10.7); ω is measured.
[[nodiscard]] ContinuousSystem<2, 1, 1> case_study_motor();

/// r = (2000 · 0.1047 rad/s, 0 A).
[[nodiscard]] Eigen::Vector2d case_study_reference();

/// One controller of a case study.
struct CaseStudy {
  std::string name;   ///< Of the columns: "lqr".
  std::string label;  ///< In the legend.
  Eigen::RowVector2d K;
  double u_ff = 0.0;  ///< The feedforward of the constant reference, V.
};

/// For 25 ms u = clamp(K (r - x) + u_ff, ±12 V), then x = A x + B u. As in the book's scripts a row
/// holds u and the x that it leads to.
[[nodiscard]] FigureResult case_study(std::string id, std::string title,
                                      const DiscreteSystem<2, 1, 1>& plant,
                                      const std::vector<CaseStudy>& controllers);

}  // namespace flyball::book
