#include <cmath>
#include <utility>
#include <vector>

#include <flyball/systems/analysis.hpp>

#include "classical/modal_response.hpp"
#include "classical/state_space_response.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/dense_reduction.hpp"
#include "math/extended/double_double.hpp"
#include "systems/balance.hpp"
#include "systems/zero_pole_gain.hpp"

namespace flyball::classical::detail {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;
using flyball::detail::DoubleDoubleMatrix;

namespace {

/// zI - H by elimination of the subdiagonal with row pivoting.
class ShiftedHessenberg {
 public:
  ShiftedHessenberg(const MatrixXd& H, Complex z) : U_(-H.cast<Complex>()) {
    const Index n = H.rows();
    U_.diagonal().array() += z;
    factors_.resize(static_cast<std::size_t>(n));
    swaps_.resize(static_cast<std::size_t>(n));
    for (Index k = 0; k + 1 < n; ++k) {
      const auto at = static_cast<std::size_t>(k);
      swaps_[at] = std::abs(U_(k + 1, k)) > std::abs(U_(k, k));
      if (swaps_[at]) {
        U_.row(k).tail(n - k).swap(U_.row(k + 1).tail(n - k));
      }
      factors_[at] = U_(k + 1, k) == 0.0 ? Complex(0.0) : U_(k + 1, k) / U_(k, k);
      for (Index j = k + 1; j < n && factors_[at] != 0.0; ++j) {
        U_(k + 1, j) -= factors_[at] * U_(k, j);
      }
    }
  }

  void solve(MatrixXcd& X) const {
    const Index n = U_.rows();
    for (Index j = 0; j < X.cols(); ++j) {
      for (Index k = 0; k + 1 < n; ++k) {
        if (swaps_[static_cast<std::size_t>(k)]) {
          std::swap(X(k, j), X(k + 1, j));
        }
        X(k + 1, j) -= factors_[static_cast<std::size_t>(k)] * X(k, j);
      }
      for (Index k = n - 1; k >= 0; --k) {
        X(k, j) /= U_(k, k);
        for (Index i = 0; i < k; ++i) {
          X(i, j) -= U_(i, k) * X(k, j);
        }
      }
    }
  }

 private:
  MatrixXcd U_;
  std::vector<Complex> factors_;
  std::vector<bool> swaps_;
};

/// Roots that rounding cannot tell from the axis are on it.
VectorXcd on_the_axis_if_near(const ModalAnalysis& modes, bool discrete) {
  VectorXcd poles(static_cast<Index>(modes.modes.size()));
  Index k = 0;
  for (const Mode& mode : modes.modes) {
    Complex pole = mode.pole;
    if (mode.stability == Stability::marginal) {
      const Complex origin = discrete ? Complex(1.0) : Complex(0.0);
      pole = std::abs(pole - origin) <= mode.uncertainty ? origin
             : discrete                                  ? pole / std::abs(pole)
                                                         : Complex(0.0, pole.imag());
    }
    poles(k++) = pole;
  }
  return poles;
}

class StateSpaceSource final : public FrequencyResponse::Source {
 public:
  StateSpaceSource(ContinuousSystem<> system, std::optional<Time> period, double delay)
      : system_(std::move(system)), period_(period), delay_(delay) {
    if (system_.A.size() == 0) {
      return;
    }
    scaled_ = flyball::detail::scaled_system(
        system_, flyball::detail::scaling_of(system_.A, system_.B, system_.C));
    hessenberg_ = flyball::detail::hessenberg_of(scaled_.A);
    // Above, its O(n³) in 31 digits is what takes the time.
    constexpr Index most_states = 100;
    if (system_.A.rows() <= most_states) {
      modal_ = ModalResponse::create(scaled_);
    }
  }

  [[nodiscard]] Index outputs() const override { return system_.C.rows(); }
  [[nodiscard]] Index inputs() const override { return system_.B.cols(); }
  [[nodiscard]] std::optional<Time> period() const override { return period_; }
  void evaluate(const VectorXd& frequencies, Complex* values) const override {
    const Index size = outputs() * inputs();
    const Index count = frequencies.size();
    if (system_.A.size() == 0) {
      for (Index k = 0; k < count; ++k) {
        Eigen::Map<MatrixXcd>(values + k * size, outputs(), inputs()) = system_.D.cast<Complex>();
      }
    } else {
      std::vector<FinePoint> points;
      points.reserve(static_cast<std::size_t>(count));
      for (const double w : frequencies) {
        points.push_back(point_on_axis(w, period_));
      }
      std::vector<Index> left;
      if (modal_) {
        left = modal_->evaluate(points, values);
      } else {
        for (Index k = 0; k < count; ++k) {
          left.push_back(k);
        }
      }
      for (const Index k : left) {
        Eigen::Map<MatrixXcd>(values + k * size, outputs(), inputs()) =
            refined(points[static_cast<std::size_t>(k)]);
      }
    }
    if (delay_ > 0.0) {
      for (Index k = 0; k < count; ++k) {
        const Complex late = std::polar(1.0, -frequencies(k) * delay_);
        for (Index i = 0; i < size; ++i) {
          values[k * size + i] *= late;
        }
      }
    }
  }
  [[nodiscard]] MatrixXcd at_point(Complex s) const override {
    const Complex z = period_ ? std::exp(s * period_->si()) : s;
    const MatrixXcd G = system_.A.size() == 0 ? MatrixXcd(system_.D.cast<Complex>())
                                              : refined({.re = z.real(), .im = z.imag()});
    return delay_ > 0.0 ? MatrixXcd(G * std::exp(-s * delay_)) : G;
  }
  [[nodiscard]] std::optional<Factors> factors(Index output, Index input) const override {
    Factors factors;
    factors.delay = delay_;
    factors.gain = system_.D(output, input);
    if (system_.A.size() == 0) {
      return factors;
    }
    const ContinuousSystem<> one{system_.A, system_.B.col(input), system_.C.row(output),
                                 system_.D.block(output, input, 1, 1)};
    const auto zpk = flyball::detail::zero_pole_gain(one);
    const auto modes =
        analyze_modes(system_.A, period_ ? TimeDomain::discrete : TimeDomain::continuous,
                      period_.value_or(Time(1.0)));
    if (!modes) {
      return std::nullopt;
    }
    factors.poles = on_the_axis_if_near(*modes, period_.has_value());
    factors.gain = zpk ? zpk->gain : 0.0;
    if (zpk) {
      factors.zeros =
          Eigen::Map<const VectorXcd>(zpk->zeros.data(), static_cast<Index>(zpk->zeros.size()));
    }
    return factors;
  }

 private:
  /// C(zI - A)⁻¹B + D by the Hessenberg form, X corrected by residuals in 31 digits until it has
  /// about as many, so that what cancels in C X costs nothing.
  [[nodiscard]] MatrixXcd refined(const FinePoint& z) const {
    const Index m = inputs();
    const MatrixXd& Q = hessenberg_.Q;
    const ShiftedHessenberg shifted(hessenberg_.H, Complex(z.re, z.im));
    const auto solve = [&](const MatrixXd& parts) {
      MatrixXcd right = flyball::detail::transposed_product(Q, parts.leftCols(m)).cast<Complex>();
      right.imag() = flyball::detail::transposed_product(Q, parts.rightCols(m));
      shifted.solve(right);
      MatrixXd solved(parts.rows(), 2 * m);
      solved << flyball::detail::product(Q, right.real()),
          flyball::detail::product(Q, right.imag());
      return solved;
    };
    MatrixXd B = MatrixXd::Zero(scaled_.B.rows(), 2 * m);
    B.leftCols(m) = scaled_.B;
    // [Xᵣ Xᵢ] [zᵣ zᵢ; -zᵢ zᵣ] is z X.
    DoubleDoubleMatrix turn = DoubleDoubleMatrix::zero(2 * m, 2 * m);
    for (Index j = 0; j < m; ++j) {
      turn.hi(j, j) = turn.hi(m + j, m + j) = z.re;
      turn.lo(j, j) = turn.lo(m + j, m + j) = z.re_lo;
      turn.hi(j, m + j) = z.im;
      turn.lo(j, m + j) = z.im_lo;
      turn.hi(m + j, j) = -z.im;
      turn.lo(m + j, j) = -z.im_lo;
    }
    const DoubleDoubleMatrix A(scaled_.A);
    DoubleDoubleMatrix X(solve(B));
    constexpr int most_corrections = 6;
    double before = std::numeric_limits<double>::infinity();
    for (int step = 0; step < most_corrections; ++step) {
      const DoubleDoubleMatrix rest =
          add_product(add_product(DoubleDoubleMatrix(B), -1.0, X, turn), 1.0, A, X);
      const MatrixXd correction = solve(rest.rounded());
      const double size = correction.norm();
      if (!(size < 0.5 * before)) {
        break;
      }
      before = size;
      X = sum(std::move(X), 1.0, DoubleDoubleMatrix(correction));
      if (size <= 1e-20 * X.norm()) {
        break;
      }
    }
    MatrixXd D = MatrixXd::Zero(outputs(), 2 * m);
    D.leftCols(m) = scaled_.D;
    const MatrixXd parts =
        add_product(DoubleDoubleMatrix(D), 1.0, DoubleDoubleMatrix(scaled_.C), X).rounded();
    MatrixXcd G = parts.leftCols(m).cast<Complex>();
    G.imag() = parts.rightCols(m);
    return G;
  }

  ContinuousSystem<> system_;
  ContinuousSystem<> scaled_;
  std::optional<Time> period_;
  double delay_ = 0.0;
  flyball::detail::Hessenberg hessenberg_;
  std::optional<ModalResponse> modal_;
};

}  // namespace

std::shared_ptr<const FrequencyResponse::Source> state_space_source(
    const ContinuousSystem<>& system, std::optional<Time> period, double delay) {
  return std::make_shared<StateSpaceSource>(system, period, delay);
}

}  // namespace flyball::classical::detail
