#include <flyball/systems/equilibrium.hpp>

#include <flyball/math/search/search_error.hpp>

#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

constexpr std::string_view in_find_equilibrium = "find_equilibrium";

/// The model about a point.
struct Local {
  Local(const AnyModel& model, const Eigen::VectorXd& x, const Eigen::VectorXd& u)
      : f(model.derivative(x, u)),
        A(model.states(), model.states()),
        B(model.states(), model.inputs()) {
    model.jacobians(x, u, A, B);
  }

  /// The size that each entry of f has where its terms do not cancel.
  [[nodiscard]] Eigen::ArrayXd scale(const Eigen::VectorXd& x, const Eigen::VectorXd& u) const {
    return 1.0 + (A.array().abs().rowwise() * x.array().abs().transpose()).rowwise().sum() +
           (B.array().abs().rowwise() * u.array().abs().transpose()).rowwise().sum();
  }
  [[nodiscard]] bool finite() const { return f.allFinite() && A.allFinite() && B.allFinite(); }

  Eigen::VectorXd f;
  Eigen::MatrixXd A, B;
};

/// What the iteration left of a zero, where zero is as good.
ModelEquilibrium without_dust(const AnyModel& model, ModelEquilibrium at) {
  constexpr double dust = 1e-12;
  ModelEquilibrium clean = at;
  clean.x = (at.x.array().abs() < dust).select(0.0, at.x);
  clean.u = (at.u.array().abs() < dust).select(0.0, at.u);
  clean.derivative = model.derivative(clean.x, clean.u);
  return clean.derivative.norm() <= at.derivative.norm() ? clean : at;
}

std::vector<double> list(const Eigen::VectorXd& v) {
  return {v.begin(), v.end()};
}

}  // namespace

bool is_equilibrium(const AnyModel& model, const MatrixRef& x, const MatrixRef& u) {
  constexpr double tolerance = 1e-9;
  const Local local(model, x, u);
  return (local.f.array().abs() <= tolerance * local.scale(x, u)).all();
}

Expected<ModelEquilibrium> find_equilibrium(const AnyModel& model, const MatrixRef& x,
                                            const MatrixRef& u, EquilibriumBy by) {
  FLYBALL_CHECK(model.check(Eigen::VectorXd(x), Eigen::VectorXd(u), in_find_equilibrium));
  constexpr int most_iterations = 100;
  constexpr double tolerance = 1e-13;
  constexpr double shortest = 1e-10;
  constexpr double farthest = 1e6;  // where a step by a Jacobian that is nearly singular lands
  ModelEquilibrium at{.x = x, .u = u};
  const Eigen::Index n = at.x.size();
  const auto refuse = [&](SearchError code, const Eigen::VectorXd& f) {
    return refusal(code, in_find_equilibrium, "the search")
        .got("without an equilibrium near the point")
        .hint("begin nearer to one, or with other inputs")
        .with("x", list(at.x))
        .with("u", list(at.u))
        .with("derivative", list(f));
  };
  for (; at.iterations < most_iterations; ++at.iterations) {
    const Local local(model, at.x, at.u);
    at.derivative = local.f;
    if (!local.finite()) {
      return refuse(SearchError::not_finite, local.f);
    }
    if (((at.x - x).array().abs() > farthest * (1.0 + x.array().abs())).any()) {
      return refuse(SearchError::no_convergence, local.f);
    }
    if ((local.f.array().abs() <= tolerance * local.scale(at.x, at.u)).all()) {
      return without_dust(model, std::move(at));
    }
    Eigen::MatrixXd J = local.A;
    if (by == EquilibriumBy::states_and_inputs) {
      J.conservativeResize(Eigen::NoChange, n + at.u.size());
      J.rightCols(at.u.size()) = local.B;
    }
    const Eigen::VectorXd step = detail::solve_least_squares(J, -local.f);
    double part = 1.0;
    for (;; part *= 0.5) {
      const Eigen::VectorXd next_x = at.x + part * step.head(n);
      const Eigen::VectorXd next_u = at.u.size() > 0 && step.size() > n
                                         ? Eigen::VectorXd(at.u + part * step.tail(at.u.size()))
                                         : at.u;
      const double size = model.derivative(next_x, next_u).norm();
      if (size < local.f.norm()) {
        at.x = next_x;
        at.u = next_u;
        break;
      }
      if (part < shortest) {
        return is_equilibrium(model, at.x, at.u) ? Expected<ModelEquilibrium>(at)
                                                 : refuse(SearchError::no_convergence, local.f);
      }
    }
  }
  return refuse(SearchError::no_convergence, at.derivative);
}

}  // namespace flyball
