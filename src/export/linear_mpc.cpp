// Linear predictive controllers as headers.
#include <flyball/export/linear_mpc.hpp>

#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "core/constants.hpp"
#include "export/mpc_texts.hpp"
#include "export/text.hpp"

namespace flyball::exports {

namespace {

std::string bound(double value) {
  return std::isinf(value) ? (value > 0.0 ? "infinity" : "-infinity") : literal(value);
}

std::string list(const Eigen::VectorXd& v) {
  std::string text;
  for (const double value : v) {
    text += (text.empty() ? "" : ", ") + bound(value);
  }
  return "{" + text + "}";
}

std::string matrix(std::string_view name, std::string_view rows, std::string_view columns,
                   const Eigen::MatrixXd& M) {
  std::string text = fmt::format("inline constexpr double {}[{}][{}] = {{\n", name, rows, columns);
  for (Eigen::Index i = 0; i < M.rows(); ++i) {
    text += "    " + list(M.row(i)) + ",\n";
  }
  return text + "};\n";
}

/// @param otherwise  For a limit that is not there.
std::string limits(std::string_view name, std::string_view size, const Eigen::VectorXd& v,
                   Eigen::Index count, double otherwise) {
  return fmt::format("inline constexpr double {}[{}] = {};\n", name, size,
                     list(v.size() > 0 ? v : Eigen::VectorXd::Constant(count, otherwise)));
}

constexpr const char* controller = R"(
}  // namespace detail

// How an answer came about.
enum class Status {
  optimal,   // to rounding, or to 1e-8 where limits of states count
  softened,  // likewise; a limit of a state cannot be kept, or is not worth it
  capped,    // the caps on iterations are reached: within the inputs' limits, not optimal
  held       // the state is not of finite numbers: the input before
};

class Controller {
 public:
  Controller() noexcept {
    for (int i = 0; i < states; ++i) {
      for (int j = 0; j < states; ++j) {
        H_[i * width + j] = Q[i][j];
        H_N_[i * width + j] = Q_end[i][j];
        put(i, j, A[i][j]);
      }
      for (int j = 0; j < inputs; ++j) {
        put(i, all + j, B[i][j]);
      }
    }
    for (int i = 0; i < inputs; ++i) {
      for (int j = 0; j < inputs; ++j) {
        H_[(all + i) * width + all + j] = R[i][j];
      }
      if (has_rates) {
        put(states + i, all + i, 1.0);
      }
    }
    for (int i = 0; i < all; ++i) {
      low_[i] = i < states ? x_min[i] : -infinity;
      high_[i] = i < states ? x_max[i] : infinity;
      sigma_[i] = i < states ? sigma[i] : 0.0;
      rho_[i] = i < states ? rho[i] : 1.0;
    }
    sides_ = 0;
    for (int k = 0; k <= horizon; ++k) {
      for (int j = 0; j < inputs && k < horizon; ++j) {
        const int at = k * width + all + j;
        side(at, -1, -1, 1.0, u_min[j], 0 * inputs + j);
        side(at, -1, -1, -1.0, u_max[j], 1 * inputs + j);
        if (has_rates) {
          side(at, at - inputs, -1, 1.0, du_min[j], 2 * inputs + j);
          side(at, at - inputs, -1, -1.0, du_max[j], 3 * inputs + j);
        }
      }
      for (int i = 0; i < all && k > 0 && has_states; ++i) {
        side(k * width + i, -1, i, 1.0, low_[i], 4 * inputs + i);
        side(k * width + i, -1, i, -1.0, high_[i], 4 * inputs + all + i);
      }
    }
    reset();
    detail::StageQp qp = program();
    know(qp);
    Method method(qp);
    method.top = horizon;
    method.begin_at_end(qp.h);
    (void)method.factor(horizon - 1, false);
    method.sweep(horizon - 1, qp.h, false);
  }

  // One period. x: the state. u: the inputs, written.
  void calculate(const double (&x)[states], double (&u)[inputs]) noexcept {
    bool known = true;
    for (int i = 0; i < states; ++i) {
      known = known && is_signal(x[i]);
      x_0_[i] = x[i];
    }
    status_ = Status::held;
    if (known) {
      for (int j = 0; j < inputs && has_rates; ++j) {
        x_0_[states + j] = within(u_last_[j], j);
      }
      for (int i = 0; i + inputs < horizon * inputs; ++i) {
        active_[i] = active_[i + inputs];
      }
      detail::StageQp qp = program();
      const detail::QpEnd end = Method(qp).solve();
      if (end == detail::QpEnd::not_finite) {
        forget();
      } else {
        for (int j = 0; j < inputs; ++j) {
          u_last_[j] = z_[all + j];
        }
        status_ = end == detail::QpEnd::solved     ? Status::optimal
                  : end == detail::QpEnd::softened ? Status::softened
                                                   : Status::capped;
      }
    }
    for (int j = 0; j < inputs; ++j) {
      u[j] = within(u_last_[j], j);
    }
  }

  // Where the states are to be, and the inputs that hold them there.
  void set_reference(const double (&r)[states], const double (&u_r)[inputs]) noexcept {
    for (int k = 0; k <= horizon; ++k) {
      for (int i = 0; i < states; ++i) {
        double sum = 0.0;
        for (int j = 0; j < states; ++j) {
          sum += (k < horizon ? Q[i][j] : Q_end[i][j]) * known(r[j]);
        }
        h_[k * width + i] = -sum;
      }
      for (int i = 0; i < inputs && k < horizon; ++i) {
        double sum = 0.0;
        for (int j = 0; j < inputs; ++j) {
          sum += R[i][j] * known(u_r[j]);
        }
        h_[k * width + all + i] = -sum;
      }
    }
    refresh();
  }

  // d of x+ = A x + B u + d.
  void set_disturbance(const double (&d)[states]) noexcept {
    has_affine_ = false;
    for (int i = 0; i < states; ++i) {
      has_affine_ = has_affine_ || known(d[i]) != 0.0;
      for (int k = 0; k < horizon; ++k) {
        b_[k * width + i] = known(d[i]);
      }
    }
    refresh();
  }

  // What was applied in the period before, if that was not the answer.
  void set_last_input(const double (&u)[inputs]) noexcept {
    for (int j = 0; j < inputs; ++j) {
      u_last_[j] = known(u[j]);
    }
  }

  void reset() noexcept {
    forget();
    for (int j = 0; j < inputs; ++j) {
      u_last_[j] = within(0.0, j);
    }
  }

  Status status() const noexcept { return status_; }
  // The last solution's state at stage k, 0 to `horizon`.
  double predicted(int k, int i) const noexcept { return z_[k * width + i]; }

 private:
  static constexpr int all = states + (has_rates ? inputs : 0);
  static constexpr int size = all + inputs;
  static constexpr int width = size <= 4 ? 4 : (size + 7) / 8 * 8;
  static constexpr int most_sides =
      horizon * (inputs * (has_rates ? 4 : 2) + (has_states ? 2 * all : 0));
  using Method = detail::StageQpMethod<all, inputs, width>;

  static bool is_signal(double value) noexcept { return value <= 1e100 && value >= -1e100; }
  static double known(double value) noexcept { return is_signal(value) ? value : 0.0; }
  static double within(double u, int j) noexcept {
    return u < u_min[j] ? u_min[j] : u > u_max[j] ? u_max[j] : u;
  }

  void put(int i, int j, double value) noexcept {
    AB_[i * width + j] = value;
    AB_t_[j * width + i] = value;
  }

  void side(int at, int minus, int state, double sign, double bound, int place) noexcept {
    if (bound < infinity && bound > -infinity) {
      bounds_[place] = bound;
      side_at_[sides_] = at;
      side_minus_[sides_] = minus;
      side_state_[sides_] = state;
      side_sign_[sides_] = sign;
      side_place_[sides_] = place;
      ++sides_;
    }
  }

  void forget() noexcept {
    for (signed char& active : active_) {
      active = 0;
    }
  }

  // What is known while no limit is active is what this program works out.
  void know(detail::StageQp& qp) noexcept {
    qp.P_free = nullptr;
    qp.P = P_free_;
    qp.L = L_free_;
    qp.pivots = pivots_free_;
    qp.p = p_free_;
    qp.g = g_free_;
    qp.active = none_;
  }

  void refresh() noexcept {
    detail::StageQp qp = program();
    know(qp);
    Method method(qp);
    method.top = horizon;
    method.begin_at_end(qp.h);
    method.sweep(horizon - 1, qp.h, false);
  }

  // Where everything stands, so that an object may be copied.
  detail::StageQp program() noexcept {
    detail::StageQp qp;
    qp.horizon = horizon;
    qp.states = all;
    qp.inputs = inputs;
    qp.width = width;
    qp.has_rates = has_rates;
    qp.has_states = has_states;
    qp.has_affine = has_affine_;
    qp.H = H_;
    qp.H_N = H_N_;
    qp.AB = AB_;
    qp.AB_t = AB_t_;
    qp.h = h_;
    qp.b = b_;
    qp.x_0 = x_0_;
    qp.lower = u_min;
    qp.upper = u_max;
    qp.rate_lower = du_min;
    qp.rate_upper = du_max;
    qp.x_lower = low_;
    qp.x_upper = high_;
    qp.sigma = sigma_;
    qp.rho = rho_;
    qp.multiplier_tolerance = multiplier_tolerance;
    qp.P_free = P_free_;
    qp.L_free = L_free_;
    qp.pivots_free = pivots_free_;
    qp.p_free = p_free_;
    qp.g_free = g_free_;
    qp.P = P_;
    qp.L = L_;
    qp.pivots = pivots_;
    qp.p = p_;
    qp.g = g_;
    qp.active = active_;
    qp.z = z_;
    qp.mu = mu_;
    qp.scratch = scratch_;
    qp.sides = sides_;
    for (int c = 0; c < sides_; ++c) {
      side_bound_[c] = bounds_ + side_place_[c];
    }
    qp.side_at = side_at_;
    qp.side_minus = side_minus_;
    qp.side_state = side_state_;
    qp.side_sign = side_sign_;
    qp.side_bound = side_bound_;
    qp.side = sides_ > 0 ? side_ : nullptr;
    qp.weights = weights_;
    qp.rate_weights = rate_weights_;
    qp.gradients = gradients_;
    qp.other_z = other_z_;
    return qp;
  }

  double H_[size * width] = {};
  double H_N_[all * width] = {};
  double AB_[all * width] = {};
  double AB_t_[size * width] = {};
  double h_[(horizon + 1) * width] = {};
  double b_[horizon * width] = {};
  double x_0_[all] = {};
  double low_[all] = {};
  double high_[all] = {};
  double sigma_[all] = {};
  double rho_[all] = {};
  double P_free_[(horizon + 1) * all * width] = {};
  double L_free_[horizon * inputs * width] = {};
  double pivots_free_[horizon * inputs] = {};
  double p_free_[(horizon + 1) * width] = {};
  double g_free_[horizon * inputs] = {};
  double P_[(horizon + 1) * all * width] = {};
  double L_[horizon * inputs * width] = {};
  double pivots_[horizon * inputs] = {};
  double p_[(horizon + 1) * width] = {};
  double g_[horizon * inputs] = {};
  double z_[(horizon + 1) * width] = {};
  double mu_[horizon * inputs] = {};
  double scratch_[(2 * size + 4) * width] = {};
  signed char active_[horizon * inputs] = {};
  signed char none_[horizon * inputs] = {};
  double bounds_[4 * inputs + 2 * all] = {};
  int sides_ = 0;
  int side_at_[most_sides] = {};
  int side_minus_[most_sides] = {};
  int side_state_[most_sides] = {};
  int side_place_[most_sides] = {};
  double side_sign_[most_sides] = {};
  const double* side_bound_[most_sides] = {};
  double side_[10 * most_sides] = {};
  double weights_[(horizon + 1) * width] = {};
  double rate_weights_[horizon * inputs] = {};
  double gradients_[(horizon + 1) * width] = {};
  double other_z_[(horizon + 1) * width] = {};
  double u_last_[inputs] = {};
  bool has_affine_ = false;
  Status status_ = Status::optimal;
};

}  // namespace mpc
)";

}  // namespace

std::string linear_mpc_header(const flyball::detail::MpcCore& mpc, std::string_view origin) {
  const MpcSettings& of = mpc.settings();
  const Eigen::Index n = mpc.states();
  const Eigen::Index m = mpc.inputs();
  std::string text = fmt::format(
      R"(// A linear model predictive controller over {} periods: {} states, {} inputs.
// Made by Flyball from {}.
#pragma once

#include <cmath>
#include <limits>
#include <limits>

namespace mpc {{

inline constexpr int states = {};
inline constexpr int inputs = {};
inline constexpr int horizon = {};
inline constexpr bool has_rates = {};
inline constexpr bool has_states = {};
inline constexpr double infinity = std::numeric_limits<double>::infinity();
inline constexpr double multiplier_tolerance = {};

// x+ = A x + B u.
)",
      of.horizon, n, m, comment_text(origin), n, m, of.horizon, of.du_min.size() > 0,
      of.x_min.size() > 0, literal(1e-10 * mpc.R().diagonal().maxCoeff()));
  text += matrix("A", "states", "states", mpc.A());
  text += matrix("B", "states", "inputs", mpc.B());
  text += "// Weights of the states, the inputs and the last state.\n";
  text += matrix("Q", "states", "states", mpc.Q());
  text += matrix("R", "inputs", "inputs", mpc.R());
  text += matrix("Q_end", "states", "states", of.Q_end);
  text += "// Limits, and what it costs to violate those of states.\n";
  text += limits("u_min", "inputs", of.u_min, m, -infinity);
  text += limits("u_max", "inputs", of.u_max, m, infinity);
  text += limits("du_min", "inputs", of.du_min, m, -infinity);
  text += limits("du_max", "inputs", of.du_max, m, infinity);
  text += limits("x_min", "states", of.x_min, n, -infinity);
  text += limits("x_max", "states", of.x_max, n, infinity);
  text += limits("sigma", "states", of.sigma, n, 0.0);
  text += limits("rho", "states", of.rho, n, 1.0);
  text += "\nnamespace detail {\n\n";
  text += mpc_program_text;
  text += '\n';
  text += mpc_method_text;
  text += controller;
  return text;
}

}  // namespace flyball::exports
