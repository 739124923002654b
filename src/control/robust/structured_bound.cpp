#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "control/robust/structured_bound.hpp"
#include "math/dense/dense.hpp"

namespace flyball::detail {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Complex j(0.0, 1.0);

/// One real unknown: how much of a Hermitian matrix is in a block's D or G.
struct Unknown {
  std::size_t block = 0;
  bool in_G = false;
  MatrixXcd E;  ///< Of the block's size; 1 x 1 of a full one, whose D is a number.
};

/// constant + Σ x_of slope is to be positive definite.
struct Inequality {
  MatrixXcd constant;
  std::vector<Index> of;
  std::vector<MatrixXcd> slope;

  [[nodiscard]] MatrixXcd at(const VectorXd& x) const {
    MatrixXcd S = constant;
    for (std::size_t i = 0; i < of.size(); ++i) {
      S += x(of[i]) * slope[i];
    }
    return S;
  }
};

/// The Hermitian matrices of a size, k² of them; or the diagonal ones.
std::vector<MatrixXcd> hermitian_basis(Index k, bool diagonal) {
  std::vector<MatrixXcd> basis;
  for (Index a = 0; a < k; ++a) {
    for (Index b = diagonal ? a : 0; b <= a; ++b) {
      MatrixXcd E = MatrixXcd::Zero(k, k);
      E(a, b) = E(b, a) = 1.0;
      basis.push_back(E);
      if (a != b) {
        E(a, b) = j;
        E(b, a) = -j;
        basis.push_back(E);
      }
    }
  }
  return basis;
}

/// Of Z = R E Rᴴ, R lower triangular, E Hermitian: its diagonal and √2 times the parts of what is
/// below, so that the product of two such columns is tr Z₁Z₂. By parts, as a product of complex
/// numbers looks for NaN. @return The trace of Z.
double sandwich(const MatrixXd& re, const MatrixXd& im, const MatrixXcd& E, MatrixXd& T_re,
                MatrixXd& T_im, double* column) {
  const Index n = re.rows();
  T_re.setZero();
  T_im.setZero();
  for (Index c = 0; c < n; ++c) {
    for (Index k = 0; k < n; ++k) {
      const double e = E(k, c).real();
      const double f = E(k, c).imag();
      if (e == 0.0 && f == 0.0) {
        continue;
      }
      for (Index i = k; i < n; ++i) {
        T_re(i, c) += re(i, k) * e - im(i, k) * f;
        T_im(i, c) += re(i, k) * f + im(i, k) * e;
      }
    }
  }
  constexpr double root = std::numbers::sqrt2;
  double trace = 0.0;
  for (Index c = 0; c < n; ++c) {
    for (Index i = c; i < n; ++i) {
      double z_re = 0.0;
      double z_im = 0.0;
      for (Index k = 0; k <= c; ++k) {
        z_re += T_re(i, k) * re(c, k) + T_im(i, k) * im(c, k);
        z_im += T_im(i, k) * re(c, k) - T_re(i, k) * im(c, k);
      }
      if (i == c) {
        trace += z_re;
        *column++ = z_re;
      } else {
        *column++ = root * z_re;
        *column++ = root * z_im;
      }
    }
  }
  return trace;
}

class ScalingSearch {
 public:
  ScalingSearch(const MatrixXcd& M, const UncertaintyStructure& structure)
      : M_(M), structure_(structure) {
    Index all = 0;
    for (const BlockSpan& block : structure.blocks) {
      all += block.is_full() ? 1 : block.rows * block.rows * (block.is_real() ? 2 : 1);
    }
    constexpr Index most = 220;  // Diagonal scalings are scalings too, in bounded time.
    const bool diagonal = all > most;
    for (std::size_t b = 0; b < structure.blocks.size(); ++b) {
      const BlockSpan& block = structure.blocks[b];
      const std::vector<MatrixXcd> basis =
          hermitian_basis(block.is_full() ? 1 : block.rows, diagonal);
      for (const MatrixXcd& E : basis) {
        unknowns_.push_back({b, false, E});
      }
      if (block.is_real()) {
        for (const MatrixXcd& E : basis) {
          unknowns_.push_back({b, true, E});
        }
      }
    }
    x_ = VectorXd::Zero(static_cast<Index>(unknowns_.size()));
    for (std::size_t i = 0; i < unknowns_.size(); ++i) {
      const Unknown& unknown = unknowns_[i];
      x_(static_cast<Index>(i)) = !unknown.in_G && is_diagonal(unknown.E) ? 0.5 : 0.0;
    }
    add_bounds();
    add_form();
  }

  StructuredBound run(double enough, double accuracy) {
    constexpr Index few = 60;  // unknowns: then the least bound costs little
    accuracy = x_.size() <= few ? std::min(accuracy, 1e-7) : accuracy;
    constexpr int most_levels = 80;
    constexpr double share = 0.1;
    const double scale = M_.squaredNorm();
    StructuredBound best{.scaling = scaling_at(x_), .squared = largest_at(x_)};
    double level = best.squared + 0.1 * std::abs(best.squared) + 1e-14 * scale;
    int idle = 0;
    for (int k = 0; k < most_levels && best.squared > enough; ++k) {
      if (!center(level)) {
        break;
      }
      const double squared = largest_at(x_);
      if (!std::isfinite(squared)) {
        break;
      }
      idle = squared > best.squared - 10.0 * accuracy * std::abs(best.squared) ? idle + 1 : 0;
      if (squared < best.squared) {
        best.scaling = scaling_at(x_);
        best.squared = squared;
      }
      // Beyond zero a form that is definite by more than rounding proves that nothing is singular.
      if (best.squared < -1e-6 * scale || idle >= 3 ||
          level - squared < accuracy * std::abs(squared) + 1e-15 * scale) {
        break;
      }
      level = squared + share * (level - squared);
    }
    best.work = work_;
    return best;
  }

 private:
  static bool is_diagonal(const MatrixXcd& E) { return E.diagonal().cwiseAbs().sum() > 0.0; }

  [[nodiscard]] StructuredScaling scaling_at(const VectorXd& x) const {
    const Index m = structure_.inputs;
    const Index p = structure_.outputs;
    StructuredScaling s{MatrixXcd::Zero(p, p), MatrixXcd::Zero(m, m), MatrixXcd::Zero(m, p)};
    for (std::size_t i = 0; i < unknowns_.size(); ++i) {
      add(unknowns_[i], x(static_cast<Index>(i)), s);
    }
    return s;
  }

  void add(const Unknown& unknown, double amount, StructuredScaling& s) const {
    const BlockSpan& block = structure_.blocks[unknown.block];
    if (block.is_full()) {
      s.D_in.diagonal().segment(block.in, block.rows).array() += amount;
      s.D_out.diagonal().segment(block.out, block.columns).array() += amount;
      return;
    }
    const Index k = block.rows;
    if (unknown.in_G) {
      s.G.block(block.in, block.out, k, k) += amount * unknown.E;
      return;
    }
    s.D_in.block(block.in, block.in, k, k) += amount * unknown.E;
    s.D_out.block(block.out, block.out, k, k) += amount * unknown.E;
  }

  [[nodiscard]] double largest_at(const VectorXd& x) const {
    const StructuredScaling s = scaling_at(x);
    return largest_ratio(-structured_form(M_, s, 0.0), s.D_in);
  }

  /// 0 < D < 1 and |G| < 100: the form is homogeneous.
  void add_bounds() {
    for (std::size_t b = 0; b < structure_.blocks.size(); ++b) {
      const BlockSpan& block = structure_.blocks[b];
      const Index k = block.is_full() ? 1 : block.rows;
      for (const bool in_G : {false, true}) {
        if (in_G && !block.is_real()) {
          continue;
        }
        const double most = in_G ? 100.0 : 1.0;
        Inequality low{(in_G ? most : 0.0) * MatrixXcd::Identity(k, k), {}, {}};
        Inequality high{most * MatrixXcd::Identity(k, k), {}, {}};
        for (std::size_t i = 0; i < unknowns_.size(); ++i) {
          if (unknowns_[i].block == b && unknowns_[i].in_G == in_G) {
            low.of.push_back(static_cast<Index>(i));
            low.slope.push_back(unknowns_[i].E);
            high.of.push_back(static_cast<Index>(i));
            high.slope.emplace_back(-unknowns_[i].E);
          }
        }
        bounds_.push_back(std::move(low));
        bounds_.push_back(std::move(high));
      }
    }
  }

  /// The form's slopes, and how they grow with β².
  void add_form() {
    form_.constant = MatrixXcd::Zero(structure_.inputs, structure_.inputs);
    for (std::size_t i = 0; i < unknowns_.size(); ++i) {
      StructuredScaling unit{MatrixXcd::Zero(structure_.outputs, structure_.outputs),
                             MatrixXcd::Zero(structure_.inputs, structure_.inputs),
                             MatrixXcd::Zero(structure_.inputs, structure_.outputs)};
      add(unknowns_[i], 1.0, unit);
      form_.of.push_back(static_cast<Index>(i));
      at_zero_.push_back(structured_form(M_, unit, 0.0));
      growth_.push_back(std::move(unit.D_in));
    }
    form_.slope = at_zero_;
  }

  /// Newton's method on -Σ ln det at a level of β², to where the decrement is small; false where
  /// the point is not within.
  bool center(double level) {
    for (std::size_t i = 0; i < at_zero_.size(); ++i) {
      form_.slope[i] = at_zero_[i] + level * growth_[i];
    }
    constexpr int most_steps = 12;
    for (int k = 0; k < most_steps; ++k) {
      const auto count = static_cast<Index>(unknowns_.size());
      const auto size = static_cast<double>(count);
      const auto entries = static_cast<double>(form_.constant.size());
      work_ += size * size * (size / 3.0 + 2.0 * entries);
      MatrixXd H = MatrixXd::Zero(count, count);
      VectorXd g = VectorXd::Zero(count);
      bool within = add_terms(form_, H, g);
      for (const Inequality& bound : bounds_) {
        within = within && add_terms(bound, H, g);
      }
      if (!within) {
        return k > 0;
      }
      const VectorXd step = solve_symmetric(H, g);
      const double decrement = std::sqrt(std::max(0.0, step.dot(g)));
      if (!std::isfinite(decrement)) {
        return k > 0;
      }
      double length = decrement > 0.25 ? 1.0 / (1.0 + decrement) : 1.0;
      const VectorXd from = x_;
      // The damped step stays within but for rounding.
      for (int halving = 0; halving < 6; ++halving, length *= 0.5) {
        x_ = from + length * step;
        if (is_within()) {
          break;
        }
        x_ = from;
      }
      if (decrement < 0.3) {
        break;
      }
    }
    return true;
  }

  [[nodiscard]] bool is_within() const {
    MatrixXcd S = form_.at(x_);
    bool within = factor_hermitian(S);
    for (const Inequality& bound : bounds_) {
      MatrixXcd B = bound.at(x_);
      within = within && factor_hermitian(B);
    }
    return within;
  }

  /// -ln det's Hessian, and its gradient's opposite.
  bool add_terms(const Inequality& inequality, MatrixXd& H, VectorXd& g) const {
    MatrixXcd S = inequality.at(x_);
    if (!factor_hermitian(S)) {
      return false;
    }
    const MatrixXcd R = inverse_of_lower(S);
    const Index n = R.rows();
    const MatrixXd re = R.real();
    const MatrixXd im = R.imag();
    const auto count = static_cast<Index>(inequality.of.size());
    MatrixXd Y(n * n, count);
    MatrixXd T_re(n, n);
    MatrixXd T_im(n, n);
    for (Index i = 0; i < count; ++i) {
      const MatrixXcd& slope = inequality.slope[static_cast<std::size_t>(i)];
      const double trace = sandwich(re, im, slope, T_re, T_im, Y.col(i).data());
      g(inequality.of[static_cast<std::size_t>(i)]) += trace;
    }
    const MatrixXd YY = transposed_product(Y, Y);
    for (Index a = 0; a < count; ++a) {
      for (Index b = 0; b < count; ++b) {
        H(inequality.of[static_cast<std::size_t>(a)], inequality.of[static_cast<std::size_t>(b)]) +=
            YY(a, b);
      }
    }
    return true;
  }

  const MatrixXcd& M_;
  const UncertaintyStructure& structure_;
  std::vector<Unknown> unknowns_;
  VectorXd x_;
  double work_ = 0.0;
  Inequality form_;
  std::vector<MatrixXcd> at_zero_, growth_;
  std::vector<Inequality> bounds_;
};

}  // namespace

StructuredBound least_structured_bound(const MatrixXcd& M, const UncertaintyStructure& structure,
                                       double enough, double accuracy) {
  return ScalingSearch(M, structure).run(enough, accuracy);
}

}  // namespace flyball::detail
