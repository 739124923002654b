#include <flyball/control/nonlinear/operating_point.hpp>

#include <vector>

#include <flyball/math/dense/linear_algebra.hpp>
#include <flyball/math/search/search_error.hpp>
#include <flyball/systems/discretize.hpp>
#include <flyball/systems/equilibrium.hpp>

#include "core/try.hpp"

namespace flyball {

namespace {

std::vector<double> list(const Eigen::VectorXd& v) {
  return {v.data(), v.data() + v.size()};
}

}  // namespace

Expected<AffineModel> affine_model(const AnyModel& model, const MatrixRef& x, const MatrixRef& u) {
  constexpr std::string_view where = "affine_model";
  FLYBALL_CHECK(model.check(Eigen::VectorXd(x), Eigen::VectorXd(u), where));
  AffineModel affine{.x = x,
                     .u = u,
                     .A = Eigen::MatrixXd(x.size(), x.size()),
                     .B = Eigen::MatrixXd(x.size(), u.size()),
                     .c = Eigen::VectorXd(x.size())};
  model.derivative(affine.x, affine.u, affine.c);
  model.jacobians(affine.x, affine.u, affine.A, affine.B);
  FLYBALL_CHECK(Checks(where).finite(affine.A, "A").finite(affine.B, "B"));
  return affine;
}

Expected<OperatingPoint> operating_point(const AnyModel& model, const MatrixRef& x,
                                         const MatrixRef& u) {
  constexpr std::string_view where = "operating_point";
  constexpr int most_iterations = 50;
  FLYBALL_TRY_IN(where, AffineModel at, affine_model(model, x, u));
  for (int iteration = 1; iteration <= most_iterations; ++iteration) {
    if (at.u.size() == 0 || at.B.norm() == 0.0) {
      return OperatingPoint{at, is_equilibrium(model, at.x, at.u), iteration};
    }
    FLYBALL_TRY_IN(where, const Pseudoinverse inverse, pseudoinverse(at.B));
    const Eigen::VectorXd step = inverse.X * at.c;  // B⁺ f(x₀, u)                      (8.2)
    const Eigen::VectorXd next = at.u - step;
    FLYBALL_TRY_IN(where, at, affine_model(model, x, next));
    FLYBALL_TRY_IN(where, const Pseudoinverse there, pseudoinverse(at.B));
    // Of a control-affine model the first step leaves nothing that an input could take.
    if ((there.X * at.c).norm() <= 1e-12 * (1.0 + next.norm())) {
      return OperatingPoint{at, is_equilibrium(model, at.x, at.u), iteration};
    }
  }
  return refusal(SearchError::no_convergence, where, "the input")
      .got("not found in 50 steps")
      .hint("begin with an input nearer to it")
      .with("x", list(at.x))
      .with("u", list(at.u))
      .with("derivative", list(at.c));
}

Expected<OperatingPointRegulator> regulate_about(const AnyModel& model, const MatrixRef& x,
                                                 const MatrixRef& u, const Weight& Q,
                                                 const Weight& R, Time period) {
  constexpr std::string_view where = "regulate_about";
  FLYBALL_TRY_IN(where, const OperatingPoint point, operating_point(model, x, u));
  if (!point.holds) {
    return refusal(SearchError::no_convergence, where, "x")
        .got("a state that no input holds")
        .expected("one at which f(x, u) = 0 for some u")
        .hint("find_equilibrium moves the state, too")
        .with("x", list(point.model.x))
        .with("u that comes nearest", list(point.model.u))
        .with("what is left of f", list(point.model.c));
  }
  FLYBALL_TRY_IN(where, const DiscretizedMatrices plant,
                 discretize_zoh(point.model.A, point.model.B, period));
  FLYBALL_TRY(const LqrDesign<> design, lqr(plant.A, plant.B, Q, R));
  return OperatingPointRegulator{point, design};
}

}  // namespace flyball
