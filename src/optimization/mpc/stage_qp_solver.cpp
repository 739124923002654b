#include <algorithm>
#include <cmath>

#include "core/constants.hpp"
#include "optimization/mpc/stage_qp_solver.hpp"

namespace flyball::optimization::detail {

namespace {

struct Kernels {
  QpEnd (*solve)(StageQp&) noexcept;
  bool (*factor)(StageQp&) noexcept;
  void (*sweep)(StageQp&) noexcept;
};

Kernels choose_kernels() {
#ifdef FLYBALL_WIDE_VECTORS
  if (__builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
      __builtin_cpu_supports("avx512vl") != 0) {
    return {widest::solve_stage_qp, widest::factor_stage_qp, widest::sweep_stage_qp};
  }
  if (flyball::detail::has_wide_vectors()) {
    return {wide::solve_stage_qp, wide::factor_stage_qp, wide::sweep_stage_qp};
  }
#endif
  return {baseline::solve_stage_qp, baseline::factor_stage_qp, baseline::sweep_stage_qp};
}

const Kernels& kernels() {
  static const Kernels chosen = choose_kernels();
  return chosen;
}

}  // namespace

StageQpSolver::StageQpSolver(const StageQpSizes& sizes) : stays_(sizes.stays) {
  const auto N = static_cast<std::size_t>(sizes.horizon);
  const auto n = static_cast<std::size_t>(sizes.states);
  const auto m = static_cast<std::size_t>(sizes.inputs);
  const std::size_t size = n + m;
  const std::size_t width = size <= 4 ? 4 : (size + 7) / 8 * 8;
  width_ = static_cast<int>(width);
  qp_.horizon = sizes.horizon;
  qp_.states = sizes.states;
  qp_.inputs = sizes.inputs;
  qp_.width = width_;
  qp_.has_rates = sizes.has_rates;
  qp_.has_states = sizes.sigma.size() > 0;
  const std::size_t matrices = sizes.stays ? 1 : N;
  const std::size_t bounds = sizes.bounds_stay ? 1 : N;
  qp_.H_stride = sizes.stays ? 0 : static_cast<int>(size * width);
  qp_.AB_stride = sizes.stays ? 0 : static_cast<int>(size * width);
  qp_.bound_stride = sizes.bounds_stay ? 0 : static_cast<int>(m);
  qp_.x_stride = sizes.bounds_stay ? 0 : static_cast<int>(n);
  H_.assign(matrices * size * width, 0.0);
  H_N_.assign(n * width, 0.0);
  AB_.assign(matrices * size * width, 0.0);
  AB_t_.assign(matrices * size * width, 0.0);
  h_.assign((N + 1) * width, 0.0);
  b_.assign(N * width, 0.0);
  x_0_.assign(n, 0.0);
  lower_.assign(bounds * m, -infinity);
  upper_.assign(bounds * m, infinity);
  rate_lower_.assign(m, -infinity);
  rate_upper_.assign(m, infinity);
  if (qp_.has_states) {
    x_lower_.assign(bounds * n, -infinity);
    x_upper_.assign(bounds * n, infinity);
    sigma_.assign(sizes.sigma.begin(), sizes.sigma.end());
    rho_.assign(sizes.rho.begin(), sizes.rho.end());
  }
  const auto factors = [&](auto& P, auto& L, auto& pivots, auto& p, auto& g) {
    P.assign((N + 1) * n * width, 0.0);
    L.assign(N * m * width, 0.0);
    pivots.assign(N * m, 0.0);
    p.assign((N + 1) * width, 0.0);
    g.assign(N * m, 0.0);
  };
  factors(P_, L_, pivots_, p_, g_);
  if (stays_) {
    factors(P_free_, L_free_, pivots_free_, p_free_, g_free_);
  }
  active_.assign(N * m, 0);
  none_active_.assign(N * m, 0);
  z_.assign((N + 1) * width, 0.0);
  mu_.assign(N * m, 0.0);
  scratch_.assign((2 * size + 4) * width, 0.0);
  bind();
}

StageQpSolver::StageQpSolver(const StageQpSolver& other) : qp_(other.qp_) {
  *this = other;
}

StageQpSolver& StageQpSolver::operator=(const StageQpSolver& other) {
  if (this == &other) {
    return *this;
  }
  StageQpSolver copy{StageQpSizes{.horizon = 0}};
  copy.qp_ = other.qp_;
  copy.width_ = other.width_;
  copy.stays_ = other.stays_;
  const auto each = [&](auto... member) { ((copy.*member = other.*member), ...); };
  using S = StageQpSolver;
  each(&S::H_, &S::H_N_, &S::AB_, &S::AB_t_, &S::h_, &S::b_, &S::x_0_, &S::lower_, &S::upper_,
       &S::rate_lower_, &S::rate_upper_, &S::x_lower_, &S::x_upper_, &S::sigma_, &S::rho_,
       &S::P_free_, &S::L_free_, &S::pivots_free_, &S::p_free_, &S::g_free_, &S::P_, &S::L_,
       &S::pivots_, &S::p_, &S::g_, &S::z_, &S::mu_, &S::scratch_, &S::active_, &S::none_active_,
       &S::side_at_, &S::side_minus_, &S::side_state_, &S::side_sign_, &S::side_, &S::weights_,
       &S::rate_weights_, &S::gradients_, &S::other_z_, &S::side_bound_);
  // Where bounds stand moves with them.
  for (const double*& bound : copy.side_bound_) {
    const auto move = [&](const std::vector<double>& from, const std::vector<double>& to) {
      if (!from.empty() && bound >= from.data() && bound < from.data() + from.size()) {
        bound = to.data() + (bound - from.data());
        return true;
      }
      return false;
    };
    (void)(move(other.lower_, copy.lower_) || move(other.upper_, copy.upper_) ||
           move(other.rate_lower_, copy.rate_lower_) || move(other.rate_upper_, copy.rate_upper_) ||
           move(other.x_lower_, copy.x_lower_) || move(other.x_upper_, copy.x_upper_));
  }
  copy.bind();
  *this = std::move(copy);
  return *this;
}

void StageQpSolver::bind() noexcept {
  qp_.H = H_.data();
  qp_.H_N = H_N_.data();
  qp_.AB = AB_.data();
  qp_.AB_t = AB_t_.data();
  qp_.h = h_.data();
  qp_.b = b_.data();
  qp_.x_0 = x_0_.data();
  qp_.lower = lower_.data();
  qp_.upper = upper_.data();
  qp_.rate_lower = rate_lower_.data();
  qp_.rate_upper = rate_upper_.data();
  qp_.x_lower = x_lower_.data();
  qp_.x_upper = x_upper_.data();
  qp_.sigma = sigma_.data();
  qp_.rho = rho_.data();
  qp_.P_free = stays_ ? P_free_.data() : nullptr;
  qp_.L_free = L_free_.data();
  qp_.pivots_free = pivots_free_.data();
  qp_.p_free = p_free_.data();
  qp_.g_free = g_free_.data();
  qp_.P = P_.data();
  qp_.L = L_.data();
  qp_.pivots = pivots_.data();
  qp_.p = p_.data();
  qp_.g = g_.data();
  qp_.active = active_.data();
  qp_.z = z_.data();
  qp_.mu = mu_.data();
  qp_.scratch = scratch_.data();
  qp_.sides = static_cast<int>(side_at_.size());
  qp_.side_at = side_at_.data();
  qp_.side_minus = side_minus_.data();
  qp_.side_state = side_state_.data();
  qp_.side_sign = side_sign_.data();
  qp_.side_bound = side_bound_.data();
  qp_.side = side_at_.empty() ? nullptr : side_.data();
  qp_.weights = weights_.data();
  qp_.rate_weights = rate_weights_.data();
  qp_.gradients = gradients_.data();
  qp_.other_z = other_z_.data();
}

void StageQpSolver::transpose(int k) noexcept {
  const double* const from = AB(k);
  double* const to = AB_t_.data() + k * qp_.AB_stride;
  const int size = qp_.states + qp_.inputs;
  for (int i = 0; i < qp_.states; ++i) {
    for (int j = 0; j < size; ++j) {
      to[j * width_ + i] = from[i * width_ + j];
    }
  }
}

bool StageQpSolver::prepare(double tolerance_scale) {
  qp_.multiplier_tolerance = 1e-10 * tolerance_scale;
  side_at_.clear();
  side_minus_.clear();
  side_state_.clear();
  side_sign_.clear();
  side_bound_.clear();
  const auto add = [&](int at, int minus, int state, double sign, const double* bound) {
    if (std::abs(*bound) < infinity) {
      side_at_.push_back(at);
      side_minus_.push_back(minus);
      side_state_.push_back(state);
      side_sign_.push_back(sign);
      side_bound_.push_back(bound);
    }
  };
  const int n = qp_.states;
  for (int k = 0; k <= qp_.horizon; ++k) {
    for (int j = 0; j < qp_.inputs && k < qp_.horizon; ++j) {
      const int at = k * width_ + n + j;
      add(at, -1, -1, 1.0, lower(k) + j);
      add(at, -1, -1, -1.0, upper(k) + j);
      if (qp_.has_rates) {
        add(at, at - qp_.inputs, -1, 1.0, rate_lower() + j);
        add(at, at - qp_.inputs, -1, -1.0, rate_upper() + j);
      }
    }
    for (int i = 0; i < n && k > 0 && qp_.has_states; ++i) {
      add(k * width_ + i, -1, i, 1.0, x_lower(k) + i);
      add(k * width_ + i, -1, i, -1.0, x_upper(k) + i);
    }
  }
  side_.assign(10 * side_at_.size(), 0.0);
  const std::size_t rows = static_cast<std::size_t>((qp_.horizon + 1) * width_);
  weights_.assign(rows, 0.0);
  gradients_.assign(rows, 0.0);
  other_z_.assign(rows, 0.0);
  rate_weights_.assign(active_.size(), 0.0);
  bind();
  if (!stays_) {
    return true;
  }
  transpose(0);
  StageQp free = qp_;
  free.P_free = nullptr;
  free.P = P_free_.data();
  free.L = L_free_.data();
  free.pivots = pivots_free_.data();
  free.p = p_free_.data();
  free.g = g_free_.data();
  free.active = none_active_.data();
  return kernels().factor(free);
}

void StageQpSolver::refresh(bool has_affine) noexcept {
  qp_.has_affine = has_affine;
  if (!stays_) {
    return;
  }
  StageQp free = qp_;
  free.P_free = nullptr;
  free.P = P_free_.data();
  free.L = L_free_.data();
  free.pivots = pivots_free_.data();
  free.p = p_free_.data();
  free.g = g_free_.data();
  free.active = none_active_.data();
  kernels().sweep(free);
}

void StageQpSolver::forget() noexcept {
  std::fill(active_.begin(), active_.end(), static_cast<signed char>(0));
}

void StageQpSolver::shift() noexcept {
  const auto m = static_cast<std::ptrdiff_t>(qp_.inputs);
  if (static_cast<std::ptrdiff_t>(active_.size()) > m) {
    std::copy(active_.begin() + m, active_.end(), active_.begin());
  }
}

QpEnd StageQpSolver::solve() noexcept {
  return kernels().solve(qp_);
}

}  // namespace flyball::optimization::detail
