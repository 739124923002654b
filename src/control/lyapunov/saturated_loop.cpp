#include <algorithm>
#include <cmath>
#include <numbers>

#include <flyball/math/expression/differentiate.hpp>

#include "control/lyapunov/loop_enclosure.hpp"
#include "control/lyapunov/saturated_loop.hpp"
#include "core/try.hpp"

namespace flyball::detail {

namespace {

Expected<void> check_limits(const SaturatedLoop& loop, std::string_view where) {
  const Eigen::Index m = loop.model.inputs;
  for (const auto& [limit, name] : {std::pair{&loop.u_min, "u_min"}, {&loop.u_max, "u_max"}}) {
    if (limit->size() > 0) {
      FLYBALL_CHECK(check_shape(*limit, m, 1, where, name, "inputs x 1"));
      for (const double value : *limit) {
        if (std::isnan(value)) {
          return refusal(ArgumentError::not_finite, where, name).got("NaN");
        }
      }
    }
  }
  for (Eigen::Index i = 0; i < m; ++i) {
    const bool above = loop.u_min.size() == 0 || loop.u(i) > loop.u_min(i);
    const bool below = loop.u_max.size() == 0 || loop.u(i) < loop.u_max(i);
    if (!above || !below) {
      return refusal(ArgumentError::out_of_range, where, "u")
          .got(format_number(loop.u(i)) + " for input " + std::to_string(i + 1))
          .expected("between its limits, so that the loop can act both ways");
    }
  }
  return {};
}

}  // namespace

Expected<void> check_saturated_loop(const SaturatedLoop& loop, std::string_view where) {
  const Eigen::Index n = loop.model.states;
  const Eigen::Index m = loop.model.inputs;
  if (n < 1 || n > most_region_states || m < 1 || m > most_region_states) {
    return refusal(ArgumentError::out_of_range, where, "the model")
        .got("of " + std::to_string(n) + " states and " + std::to_string(m) + " inputs")
        .expected("of 1 to " + std::to_string(most_region_states) + " of each");
  }
  if (loop.model.f.inputs() != static_cast<std::size_t>(n + m) ||
      loop.model.f.outputs() != static_cast<std::size_t>(n) ||
      loop.model.f.parameters() != loop.model.parameters.size()) {
    return refusal(ArgumentError::wrong_shape, where, "the model's tape")
        .got("of other sizes than its states, inputs and parameters say");
  }
  FLYBALL_CHECK(Checks(where)
                    .shape(loop.x, n, 1, "x", "states x 1")
                    .finite(loop.x, "x")
                    .shape(loop.u, m, 1, "u", "inputs x 1")
                    .finite(loop.u, "u")
                    .shape(loop.K, m, n, "K", "inputs x states")
                    .finite(loop.K, "K"));
  FLYBALL_CHECK(check_limits(loop, where));
  for (const Eigen::Index i : loop.angles) {
    if (i < 0 || i >= n) {
      return refusal(ArgumentError::out_of_range, where, "angles")
          .got(std::to_string(i))
          .expected("indices of states");
    }
  }
  const LinearPart linear = linear_part(loop);
  if (!linear.A.allFinite() || !linear.B.allFinite()) {
    return refusal(ArgumentError::not_finite, where, "a derivative of the model at x");
  }
  Eigen::VectorXd rate(n);
  SaturatedMotion(loop).derivative(loop.x, rate);
  // As far as rounding of x moves it.
  constexpr double rounding = 1e-9;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double scale = linear.A.row(i).cwiseAbs().dot(loop.x.cwiseAbs().cwiseMax(1.0)) +
                         linear.B.row(i).cwiseAbs().dot(loop.u.cwiseAbs());
    if (!(std::abs(rate(i)) <= rounding * std::max(scale, 1.0))) {
      return refusal(RegionError::not_an_equilibrium, where, "x")
          .got("no equilibrium: state " + std::to_string(i + 1) + " changes by " +
               format_number(rate(i)) + " a second")
          .hint("find_equilibrium has one near it");
    }
  }
  return {};
}

LinearPart linear_part(const SaturatedLoop& loop) {
  const Eigen::Index n = loop.model.states;
  const Eigen::Index m = loop.model.inputs;
  const expression::Derivatives derivatives = expression::differentiate(loop.model.f);
  std::vector<double> values(derivatives.workspace_size());
  derivatives.tape.prepare<double>(loop.model.parameters,
                                   std::span(values).first(derivatives.tape.size()));
  std::vector<double> in(loop.x.begin(), loop.x.end());
  in.insert(in.end(), loop.u.begin(), loop.u.end());
  std::vector<double> f(static_cast<std::size_t>(n));
  Eigen::MatrixXd J(n, n + m);
  derivatives.evaluate(in, f, J, values);
  return {J.leftCols(n), J.rightCols(m)};
}

SaturatedMotion::SaturatedMotion(const SaturatedLoop& loop)
    : loop_(loop),
      values_(loop.model.f.size()),
      in_(static_cast<std::size_t>(loop.model.states + loop.model.inputs)),
      at_(loop.model.states) {
  loop.model.f.prepare<double>(loop.model.parameters, values_);
  for (Eigen::VectorXd& k : k_) {
    k.resize(loop.model.states);
  }
}

void SaturatedMotion::derivative(const Eigen::VectorXd& x, Eigen::VectorXd& dxdt) {
  const Eigen::Index n = loop_.model.states;
  std::copy(x.begin(), x.end(), in_.begin());
  for (Eigen::Index i = 0; i < loop_.model.inputs; ++i) {
    double u = loop_.u(i);
    for (Eigen::Index j = 0; j < n; ++j) {
      double e = loop_.x(j) - x(j);
      if (std::find(loop_.angles.begin(), loop_.angles.end(), j) != loop_.angles.end()) {
        e = std::remainder(e, 2.0 * std::numbers::pi);
      }
      u += loop_.K(i, j) * e;
    }
    if (loop_.u_min.size() > 0) {
      u = std::max(u, loop_.u_min(i));
    }
    if (loop_.u_max.size() > 0) {
      u = std::min(u, loop_.u_max(i));
    }
    in_[static_cast<std::size_t>(n + i)] = u;
  }
  loop_.model.f.evaluate<double>(in_, {dxdt.data(), static_cast<std::size_t>(n)}, values_);
}

void SaturatedMotion::step(Eigen::VectorXd& x, double dt) {
  derivative(x, k_[0]);
  at_ = x + 0.5 * dt * k_[0];
  derivative(at_, k_[1]);
  at_ = x + 0.5 * dt * k_[1];
  derivative(at_, k_[2]);
  at_ = x + dt * k_[2];
  derivative(at_, k_[3]);
  x += dt / 6.0 * (k_[0] + 2.0 * k_[1] + 2.0 * k_[2] + k_[3]);
}

}  // namespace flyball::detail
