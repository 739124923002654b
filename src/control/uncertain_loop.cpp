#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

#include "control/uncertain_loop.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/dense_reduction.hpp"

namespace flyball::detail {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;

/// |C(zI - A)⁻¹B + D| on the unit circle, M = [A B; C D]: with A in Hessenberg form each costs
/// O(n²).
class ChannelGain {
 public:
  explicit ChannelGain(const Eigen::MatrixXd& M) : n_(M.rows() - 1), D_(M(n_, n_)) {
    Hessenberg form = hessenberg_of(M.topLeftCorner(n_, n_));
    B_ = transposed_product(form.Q, M.topRightCorner(n_, 1));
    C_ = product(M.bottomLeftCorner(1, n_), form.Q);
    H_ = std::move(form.H);
  }

  /// By elimination of the subdiagonal with row pivoting.
  [[nodiscard]] double operator()(double theta) {
    U_ = -H_.cast<Complex>();
    U_.diagonal().array() += std::polar(1.0, theta);
    x_ = B_.cast<Complex>();
    for (Index k = 0; k + 1 < n_; ++k) {
      if (std::abs(U_(k + 1, k)) > std::abs(U_(k, k))) {
        U_.row(k).tail(n_ - k).swap(U_.row(k + 1).tail(n_ - k));
        std::swap(x_(k), x_(k + 1));
      }
      if (U_(k + 1, k) != 0.0) {
        const Complex factor = U_(k + 1, k) / U_(k, k);
        U_.row(k + 1).tail(n_ - k - 1) -= factor * U_.row(k).tail(n_ - k - 1);
        x_(k + 1) -= factor * x_(k);
      }
    }
    Complex y = D_;
    for (Index k = n_ - 1; k >= 0; --k) {
      x_(k) /= U_(k, k);
      x_.head(k) -= U_.col(k).head(k) * x_(k);
      y += C_(0, k) * x_(k);
    }
    return std::abs(y);
  }

 private:
  Index n_;
  double D_;
  Eigen::MatrixXd H_, B_, C_;
  Eigen::MatrixXcd U_{};
  Eigen::VectorXcd x_{};
};

/// The plant sampled: e^{AT}, Γ(T) and Γ(T - f), Γ(t) = ∫₀ᵗ e^{As} ds B.
struct SampledForms {
  FormMatrix A, whole, newer;
};

FormMatrix combined(const Eigen::MatrixXd& at_zero, const std::vector<Eigen::MatrixXd>& slopes,
                    const std::vector<TaylorForm>& parameters) {
  FormMatrix sum(at_zero);
  for (std::size_t i = 0; i < slopes.size(); ++i) {
    for (Index r = 0; r < at_zero.rows(); ++r) {
      for (Index c = 0; c < at_zero.cols(); ++c) {
        if (slopes[i](r, c) != 0.0) {
          sum(r, c) = sum(r, c) + TaylorForm(slopes[i](r, c)) * parameters[i];
        }
      }
    }
  }
  return sum;
}

std::optional<SampledForms> sampled(const LinearPlantFamily& family,
                                    const std::vector<TaylorForm>& p, const TaylorForm& period,
                                    const TaylorForm& rest, bool exact) {
  const Index n = family.A.rows();
  FormMatrix A = combined(family.A, family.A_p, p);
  FormMatrix B = combined(family.B, family.B_p, p);
  FormMatrix both(n, n + 1);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      both(i, j) = A(i, j);
    }
    both(i, n) = B(i, 0);
  }
  if (family.E.size() > 0 || !family.E_p.empty()) {
    const Eigen::MatrixXd E_0 =
        family.E.size() > 0 ? family.E : Eigen::MatrixXd(Eigen::MatrixXd::Identity(n, n));
    auto divided = solve(combined(E_0, family.E_p, p), both);
    if (!divided) {
      return std::nullopt;
    }
    both = *std::move(divided);
  }
  const auto over = [&](const TaylorForm& time) {
    FormMatrix H(n + 1, n + 1);
    for (Index i = 0; i < n; ++i) {
      for (Index j = 0; j <= n; ++j) {
        H(i, j) = time * both(i, j);
      }
    }
    return exponential(H);
  };
  const auto whole = over(period);
  if (!whole) {
    return std::nullopt;
  }
  const auto newer = exact ? whole : over(rest);
  if (!newer) {
    return std::nullopt;
  }
  return SampledForms{whole->block(0, 0, n, n), whole->block(0, n, n, 1), newer->block(0, n, n, 1)};
}

/// e^{-t kV/kA}, 0 where kA is.
TaylorForm decayed(const TaylorForm& time, const TaylorForm& kV, const TaylorForm& kA) {
  const Interval inertia = kA.range();
  const Interval rate = kV.range();
  constexpr double nothing = 1e-300;
  if (inertia.high <= nothing) {
    // 1 - e^{-t kV/kA} is one to the last bit, and 1e-300 more or less is in the radius.
    return TaylorForm::between({0.0, nothing});
  }
  constexpr double gone = 40.0;
  const Interval slowest =
      Interval(std::max(0.0, time.range().low)) * Interval(rate.low) / Interval(inertia.high);
  if (inertia.low <= 0.0 || slowest.low > gone) {
    return TaylorForm::between({0.0, std::min(1.0, exp(-slowest.low).high)});
  }
  return exp(-(time * kV * reciprocal(kA)));
}

std::optional<SampledForms> sampled(const MechanismFamily& family, const std::vector<TaylorForm>& p,
                                    const TaylorForm& period, const TaylorForm& rest, bool exact) {
  const TaylorForm& kV = p[0];
  const TaylorForm kA = family.logarithmic ? exp(p[1]) : p[1];
  if (!(kV.range().low > 0.0) || !std::isfinite(kA.magnitude())) {
    return std::nullopt;
  }
  const TaylorForm speed = reciprocal(kV);
  const TaylorForm constant = kA * speed;  // τ = kA/kV
  const TaylorForm one(1.0);
  const auto gamma = [&](const TaylorForm& time, const TaylorForm& left) {
    const TaylorForm gained = one - left;
    FormMatrix B(family.position ? 2 : 1, 1);
    if (family.position) {
      B(0, 0) = speed * (time - constant * gained);
      B(1, 0) = speed * gained;
    } else {
      B(0, 0) = speed * gained;
    }
    return B;
  };
  const TaylorForm left = decayed(period, kV, kA);
  SampledForms forms;
  if (family.position) {
    forms.A = FormMatrix::identity(2);
    forms.A(0, 1) = constant * (one - left);
    forms.A(1, 1) = left;
  } else {
    forms.A = FormMatrix(1, 1);
    forms.A(0, 0) = left;
  }
  forms.whole = gamma(period, left);
  forms.newer = exact ? forms.whole : gamma(rest, decayed(rest, kV, kA));
  return forms;
}

bool finite(const FormMatrix& M) {
  for (Index i = 0; i < M.rows(); ++i) {
    for (Index j = 0; j < M.cols(); ++j) {
      if (!std::isfinite(M(i, j).magnitude())) {
        return false;
      }
    }
  }
  return true;
}

double whole_within_rounding(double periods) {
  constexpr double rounding = 1e-12;
  const double nearest = std::round(periods);
  return std::abs(periods - nearest) <= rounding * std::max(1.0, periods) ? nearest : -1.0;
}

}  // namespace

std::vector<TaylorForm> parameters_over(const ParameterSet& set, const SetPiece& piece) {
  std::vector<TaylorForm> parameters;
  for (Index i = 0; i < set.centre.size(); ++i) {
    TaylorForm x(set.centre(i));
    for (Index j = 0; j < set.axes.cols(); ++j) {
      if (set.axes(i, j) != 0.0) {
        x = x + TaylorForm(set.axes(i, j)) *
                    TaylorForm::parameter(static_cast<int>(j), piece.middle(j), piece.half(j));
      }
    }
    parameters.push_back(x);
  }
  return parameters;
}

std::optional<std::vector<DelayBranch>> branches_over(const TaylorForm& delay, double period) {
  std::vector<DelayBranch> branches;
  const Interval range = delay.range();
  if (range.high < 0.0) {
    return branches;
  }
  const double low = std::max(0.0, range.low) / period;
  const double high = range.high / period;
  if (const double whole = whole_within_rounding(0.5 * (low + high));
      whole >= 0.0 && whole_within_rounding(low) == whole && whole_within_rounding(high) == whole) {
    branches.push_back({static_cast<int>(whole), true});
    return branches;
  }
  // Where a piece ends at whole periods the structure of one side holds for both.
  const double first =
      whole_within_rounding(low) >= 0.0 ? whole_within_rounding(low) : std::floor(low);
  const double last =
      whole_within_rounding(high) >= 0.0 ? whole_within_rounding(high) : std::ceil(high);
  if (!(last - first <= most_delay_periods + 2.0)) {
    return std::nullopt;
  }
  for (double d = first; d < last; d += 1.0) {
    branches.push_back({static_cast<int>(d), false});
  }
  return branches;
}

std::optional<FormMatrix> closed_loop_over(const UncertainLoop& loop,
                                           const std::vector<TaylorForm>& parameters,
                                           const DelayBranch& branch, double disk, double decay) {
  const TaylorForm& gain = parameters[parameters.size() - 2];
  const TaylorForm& delay = parameters.back();
  const TaylorForm period(loop.period.si());
  // T - f, f = delay - d T.
  const TaylorForm rest =
      branch.exact ? period : TaylorForm(branch.whole_periods + 1.0) * period - delay;
  const auto plant = std::visit(
      [&](const auto& family) { return sampled(family, parameters, period, rest, branch.exact); },
      loop.plant);
  if (!plant) {
    return std::nullopt;
  }
  const Index n = plant->A.rows();
  const Index stored = branch.stored();
  const Index q = loop.A_c.rows();
  const Index N = n + stored + q;
  const FormMatrix older = plant->whole - plant->newer;

  // v = -(D_c C x + C_c q); u = v is stored, and the gain acts on what is sent.
  const FormMatrix C(loop.C);
  const FormMatrix direct = FormMatrix(loop.D_c) * C;
  const FormMatrix to_controller = FormMatrix(loop.B_c) * C;
  FormMatrix V(1, N);
  for (Index j = 0; j < n; ++j) {
    V(0, j) = -direct(0, j);
  }
  for (Index j = 0; j < q; ++j) {
    V(0, n + stored + j) = TaylorForm(-loop.C_c(0, j));
  }
  FormMatrix input(N, 1);
  FormMatrix M(N, N);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      M(i, j) = plant->A(i, j);
    }
  }
  // The column of u_{k-j}: j = 0 is the input of now.
  const auto place = [&](Index j, const FormMatrix& column) {
    for (Index i = 0; i < n; ++i) {
      (j == 0 ? input(i, 0) : M(i, n + j - 1)) = column(i, 0);
    }
  };
  place(branch.whole_periods, plant->newer);
  if (!branch.exact) {
    place(branch.whole_periods + 1, older);
  }
  if (stored > 0) {
    input(n, 0) = TaylorForm(1.0);
  }
  for (Index j = 1; j < stored; ++j) {
    M(n + j, n + j - 1) = TaylorForm(1.0);
  }
  input = gain * std::move(input);
  for (Index i = 0; i < N; ++i) {
    if (input(i, 0).magnitude() == 0.0) {
      continue;
    }
    for (Index j = 0; j < N; ++j) {
      if (V(0, j).magnitude() != 0.0) {
        M(i, j) = M(i, j) + input(i, 0) * V(0, j);
      }
    }
  }
  for (Index i = 0; i < q; ++i) {
    for (Index j = 0; j < n; ++j) {
      M(n + stored + i, j) = to_controller(i, j);
    }
    for (Index j = 0; j < q; ++j) {
      M(n + stored + i, n + stored + j) = TaylorForm(loop.A_c(i, j));
    }
  }
  if (decay != 1.0) {
    for (Index i = 0; i < N; ++i) {
      for (Index j = 0; j < N; ++j) {
        M(i, j) = M(i, j) / decay;
      }
    }
  }
  if (!(disk > 0.0)) {
    return finite(M) ? std::optional(std::move(M)) : std::nullopt;
  }
  // u = v + w, z = a (2 v + w), a = α/2.
  const double a = 0.5 * disk;
  FormMatrix widened(N + 1, N + 1);
  for (Index i = 0; i < N; ++i) {
    for (Index j = 0; j < N; ++j) {
      widened(i, j) = M(i, j);
    }
    widened(i, N) = input(i, 0);
    widened(N, i) = V(0, i) * TaylorForm(disk);
  }
  widened(N, N) = TaylorForm(a);
  return finite(widened) ? std::optional(std::move(widened)) : std::nullopt;
}

Eigen::VectorXd parameters_at(const ParameterSet& set, const Eigen::VectorXd& z) {
  return set.centre + set.axes * z;
}

double disk_margin_of(const Eigen::MatrixXd& M, const Eigen::VectorXcd& poles) {
  ChannelGain gain(M);
  // A grid that is finer towards zero, and where the poles are; the best is refined.
  std::vector<double> grid;
  constexpr int points = 48;
  for (int i = 0; i <= points; ++i) {
    const double share = static_cast<double>(i) / points;
    grid.push_back(std::numbers::pi * share * share);
  }
  for (const Complex pole : poles) {
    if (std::abs(pole) > 0.3) {
      grid.push_back(std::abs(std::arg(pole)));
    }
  }
  std::sort(grid.begin(), grid.end());
  grid.erase(std::unique(grid.begin(), grid.end()), grid.end());
  std::vector<double> values;
  for (const double theta : grid) {
    values.push_back(gain(theta));
  }
  const auto best =
      static_cast<std::size_t>(std::max_element(values.begin(), values.end()) - values.begin());
  double low = grid[best == 0 ? 0 : best - 1];
  double high = grid[best + 1 == grid.size() ? best : best + 1];
  constexpr double golden = 0.6180339887498949;
  double inner = high - golden * (high - low);
  double outer = low + golden * (high - low);
  double at_inner = gain(inner);
  double at_outer = gain(outer);
  for (int k = 0; k < 24; ++k) {
    if (at_inner > at_outer) {
      high = outer;
      outer = inner;
      at_outer = at_inner;
      inner = high - golden * (high - low);
      at_inner = gain(inner);
    } else {
      low = inner;
      inner = outer;
      at_inner = at_outer;
      outer = low + golden * (high - low);
      at_outer = gain(outer);
    }
  }
  const double peak = std::max({values[best], at_inner, at_outer});
  return peak > 0.0 ? 2.0 / peak : std::numeric_limits<double>::infinity();
}

}  // namespace flyball::detail
