// Predictive controllers of linear plants, and what all of them share.
#include <flyball/control/mpc/linear_mpc.hpp>

#include <algorithm>
#include <string>

#include <flyball/control/lqr.hpp>

#include "control/mpc/mpc_limits.hpp"
#include "control/mpc/mpc_parts.hpp"
#include "core/constants.hpp"
#include "core/try.hpp"

namespace flyball::detail {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using optimization::detail::QpEnd;
using optimization::detail::StageQpSizes;

MpcCore::Parts::Parts(int states, int inputs, const MatrixRef& weight_Q, const MatrixRef& weight_R,
                      const MpcSettings& limits, const StageQpSizes& sizes)
    : Q(weight_Q),
      R(weight_R),
      settings(limits),
      qp(sizes),
      n(states),
      m(inputs),
      rates(sizes.has_rates ? inputs : 0) {}

void MpcCore::Parts::fill_cost(int stages) {
  const int width = qp.width();
  const int before = n + rates;
  for (int k = 0; k < stages; ++k) {
    double* const H = qp.H(k);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        H[i * width + j] = Q(i, j);
        qp.H_end()[i * width + j] = settings.Q_end(i, j);
      }
    }
    for (int i = 0; i < m; ++i) {
      for (int j = 0; j < m; ++j) {
        H[(before + i) * width + before + j] = R(i, j);
      }
      if (rates > 0) {
        qp.AB(k)[(n + i) * width + before + i] = 1.0;
      }
    }
  }
}

void MpcCore::Parts::fill_plant(const MatrixRef& plant_A, const MatrixRef& plant_B) {
  A = plant_A;
  B = plant_B;
  double* const AB = qp.AB(0);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      AB[i * qp.width() + j] = A(i, j);
    }
    for (int j = 0; j < m; ++j) {
      AB[i * qp.width() + n + rates + j] = B(i, j);
    }
  }
}

bool MpcCore::Parts::finish() {
  const int N = settings.horizon;
  const auto copy = [](const VectorXd& from, double* to) {
    std::copy(from.begin(), from.end(), to);
  };
  copy(settings.u_min, qp.lower(0));
  copy(settings.u_max, qp.upper(0));
  if (rates > 0) {
    copy(settings.du_min, qp.rate_lower());
    copy(settings.du_max, qp.rate_upper());
  }
  if (qp.qp().has_states) {
    std::fill_n(qp.x_lower(1), n + rates, -infinity);
    std::fill_n(qp.x_upper(1), n + rates, infinity);
    copy(settings.x_min, qp.x_lower(1));
    copy(settings.x_max, qp.x_upper(1));
  }
  u_last = VectorXd::Zero(m).cwiseMax(settings.u_min).cwiseMin(settings.u_max);
  reference.setZero(n * (N + 1));
  input_reference.setZero(m * N);
  if (!qp.prepare(R.diagonal().maxCoeff())) {
    return false;
  }
  qp.refresh(false);
  return true;
}

Expected<MpcCore> MpcCore::make(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                                const MatrixRef& R, const MpcSettings& settings) {
  constexpr std::string_view where = "linear_mpc";
  FLYBALL_CHECK(Checks(where)
                    .square(A, "A")
                    .finite(A, "A")
                    .shape(B, A.rows(), std::max<Index>(B.cols(), 1), "B", "states x inputs")
                    .finite(B, "B"));
  FLYBALL_TRY(MpcSettings complete,
              complete_settings(settings, A.rows(), B.cols(), Q, R, where, [&] {
                return lqr(A, B, MatrixXd(Q), MatrixXd(R)).map([](const LqrDesign<>& design) {
                  return MatrixXd(design.S);
                });
              }));
  StageQpSizes sizes = sizes_of(complete, A.rows(), B.cols());
  auto parts = std::make_unique<Parts>(static_cast<int>(A.rows()), static_cast<int>(B.cols()), Q, R,
                                       complete, sizes);
  parts->fill_cost(1);
  parts->fill_plant(A, B);
  if (!parts->finish()) {
    return refusal(ArgumentError::not_positive, where, "the cost over the horizon")
        .got("a curvature that is lost in rounding")
        .expected("of Q and R whose sizes can be added");
  }
  return MpcCore(std::move(parts));
}

MpcCore::MpcCore(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
MpcCore::MpcCore(const MpcCore& other) : parts_(std::make_unique<Parts>(*other.parts_)) {}
MpcCore::MpcCore(MpcCore&&) noexcept = default;
MpcCore& MpcCore::operator=(const MpcCore& other) {
  if (this != &other) {
    parts_ = std::make_unique<Parts>(*other.parts_);
  }
  return *this;
}
MpcCore& MpcCore::operator=(MpcCore&&) noexcept = default;
MpcCore::~MpcCore() = default;

void MpcCore::Parts::hold(double* u) const noexcept {
  for (int j = 0; j < m; ++j) {
    u[j] = std::clamp(u_last(j), qp.qp().lower[j], qp.qp().upper[j]);
  }
}

/// One program, from a state that is of finite numbers.
MpcStatus MpcCore::Parts::solve(const double* x) noexcept {
  std::copy(x, x + n, qp.x_0());
  for (int j = 0; j < rates; ++j) {
    qp.x_0()[n + j] = std::clamp(u_last(j), qp.lower(0)[j], qp.upper(0)[j]);
  }
  const QpEnd end = qp.solve();
  iterations += qp.qp().rounds + qp.qp().steps;
  if (end == QpEnd::not_finite) {
    qp.forget();
    return MpcStatus::held;
  }
  return end == QpEnd::solved     ? MpcStatus::optimal
         : end == QpEnd::softened ? MpcStatus::softened
                                  : MpcStatus::capped;
}

MpcStatus MpcCore::calculate(const double* x, double* u) noexcept {
  Parts& p = *parts_;
  p.iterations = 0;
  MpcStatus status = MpcStatus::held;
  if (std::all_of(x, x + p.n, [](double value) { return is_signal(value); })) {
    p.qp.shift();
    status = p.model ? p.iterate(x) : p.solve(x);
    if (status != MpcStatus::held) {
      const double* const z = p.qp.z(0) + p.n + p.rates;
      std::copy(z, z + p.m, p.u_last.data());
    }
  }
  p.hold(u);
  return status;
}

bool MpcCore::set_reference(const double* r, const double* u_r) noexcept {
  Parts& p = *parts_;
  const auto known = [](const double* from, int count) {
    return std::all_of(from, from + count, [](double value) { return is_signal(value); });
  };
  if (!known(r, p.n) || !known(u_r, p.m)) {
    return false;
  }
  for (int k = 0; k <= p.settings.horizon; ++k) {
    std::copy(r, r + p.n, p.reference.data() + k * p.n);
    if (k < p.settings.horizon) {
      std::copy(u_r, u_r + p.m, p.input_reference.data() + k * p.m);
    }
  }
  return set_trajectory(p.reference.data(), p.input_reference.data());
}

bool MpcCore::set_trajectory(const double* r, const double* u_r) noexcept {
  Parts& p = *parts_;
  const int N = p.settings.horizon;
  const auto known = [](const double* from, int count) {
    return std::all_of(from, from + count, [](double value) { return is_signal(value); });
  };
  if (!known(r, p.n * (N + 1)) || !known(u_r, p.m * N)) {
    return false;
  }
  if (r != p.reference.data()) {
    std::copy(r, r + p.n * (N + 1), p.reference.data());
    std::copy(u_r, u_r + p.m * N, p.input_reference.data());
  }
  // h = -Q r, -R u_r; the constant ½ rᵀQ r is kept apart.
  p.offset = 0.0;
  const auto write = [&p](double* h, const MatrixXd& weight, const double* at) {
    for (Index i = 0; i < weight.rows(); ++i) {
      double sum = 0.0;
      for (Index j = 0; j < weight.cols(); ++j) {
        sum += weight(i, j) * at[j];
      }
      h[i] = -sum;
      p.offset += 0.5 * sum * at[i];
    }
  };
  for (int k = 0; k <= N; ++k) {
    write(p.qp.h(k), k < N ? p.Q : p.settings.Q_end, p.reference.data() + k * p.n);
    if (k < N) {
      write(p.qp.h(k) + p.n + p.rates, p.R, p.input_reference.data() + k * p.m);
    }
  }
  p.qp.refresh(p.qp.qp().has_affine);
  return true;
}

bool MpcCore::set_disturbance(const double* d) noexcept {
  Parts& p = *parts_;
  if (!std::all_of(d, d + p.n, [](double value) { return is_signal(value); })) {
    return false;
  }
  for (int k = 0; k < p.settings.horizon; ++k) {
    std::copy(d, d + p.n, p.qp.b(k));
  }
  p.qp.refresh(std::any_of(d, d + p.n, [](double value) { return value != 0.0; }));
  return true;
}

bool MpcCore::set_input_limits(const double* u_min, const double* u_max) noexcept {
  Parts& p = *parts_;
  double* const low = p.qp.lower(0);
  double* const high = p.qp.upper(0);
  for (int j = 0; j < p.m; ++j) {
    if (!(u_min[j] <= u_max[j]) || is_signal(u_min[j]) != is_signal(low[j]) ||
        is_signal(u_max[j]) != is_signal(high[j])) {
      return false;
    }
  }
  std::copy(u_min, u_min + p.m, low);
  std::copy(u_max, u_max + p.m, high);
  return true;
}

bool MpcCore::set_last_input(const double* u) noexcept {
  Parts& p = *parts_;
  if (!std::all_of(u, u + p.m, [](double value) { return is_signal(value); })) {
    return false;
  }
  std::copy(u, u + p.m, p.u_last.data());
  return true;
}

void MpcCore::reset() noexcept {
  Parts& p = *parts_;
  p.qp.forget();
  p.has_trajectory = false;
  p.u_last.setZero();
  p.hold(p.u_last.data());
}

const double* MpcCore::state(int k) const noexcept {
  return parts_->qp.z(std::clamp(k, 0, parts_->settings.horizon));
}
const double* MpcCore::input(int k) const noexcept {
  return parts_->qp.z(std::clamp(k, 0, parts_->settings.horizon - 1)) + parts_->n + parts_->rates;
}

double MpcCore::cost() const noexcept {
  const Parts& p = *parts_;
  const optimization::detail::StageQp& qp = p.qp.qp();
  const int N = qp.horizon;
  double sum = p.offset;
  for (int k = 0; k <= N; ++k) {
    const double* const z = p.qp.z(k);
    const int rows = k < N ? qp.states + qp.inputs : qp.states;
    const double* const H = k < N ? qp.H + k * qp.H_stride : qp.H_N;
    for (int i = 0; i < rows; ++i) {
      double row = 2.0 * qp.h[k * qp.width + i];
      for (int j = 0; j < rows; ++j) {
        row += H[i * qp.width + j] * z[j];
      }
      sum += 0.5 * row * z[i];
    }
    for (int i = 0; i < p.n && k > 0 && qp.has_states; ++i) {
      const double over = std::max({0.0, qp.x_lower[i] - z[i], z[i] - qp.x_upper[i]});
      sum += over * (qp.sigma[i] + 0.5 * qp.rho[i] * over);
    }
  }
  return sum;
}

double MpcCore::violation() const noexcept {
  return parts_->qp.qp().violation;
}
double MpcCore::change() const noexcept {
  return parts_->change;
}
int MpcCore::iterations() const noexcept {
  return parts_->iterations;
}
const MpcSettings& MpcCore::settings() const noexcept {
  return parts_->settings;
}
int MpcCore::states() const noexcept {
  return parts_->n;
}
int MpcCore::inputs() const noexcept {
  return parts_->m;
}
const MatrixXd& MpcCore::A() const noexcept {
  return parts_->A;
}
const MatrixXd& MpcCore::B() const noexcept {
  return parts_->B;
}
const MatrixXd& MpcCore::Q() const noexcept {
  return parts_->Q;
}
const MatrixXd& MpcCore::R() const noexcept {
  return parts_->R;
}

}  // namespace flyball::detail
