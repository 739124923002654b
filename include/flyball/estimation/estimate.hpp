#pragma once

#include <algorithm>

#include <flyball/core/signal.hpp>
#include <flyball/estimation/correction.hpp>
#include <flyball/estimation/forms/joseph_covariance.hpp>
#include <flyball/estimation/outlier_guard.hpp>
#include <flyball/geometry/manifold.hpp>

namespace flyball {

namespace detail {

/// Whether a state has nothing that is not a number: of a group, its matrix.
template <class X>
[[nodiscard]] bool is_usable(const X& next, const X& before) noexcept {
  if constexpr (EigenVector<X>) {
    return is_signal(next);
  } else if constexpr (requires { next.matrix(); }) {
    return is_signal(next.matrix());
  } else {
    return is_signal(minus(next, before));
  }
}

}  // namespace detail

/// A state and the covariance of its error, x = x_hat ⊕ e with e ~ N(0, P): the core that every
/// filter moves by `predict` and `correct`. The state is a vector or any other Manifold; the form
/// is how P is carried (JosephCovariance, UdCovariance, SquareRootCovariance, InformationForm).
///
/// A measurement's entries are made independent and taken one after the other, which gives what all
/// at once give, without a matrix to invert.
///
/// Run-time object: noexcept, bounded, finite whatever comes, and for sizes known at compile time
/// allocation-free. A prediction or correction that cannot be made leaves it as it was.
/// Source: book, Theorem 9.6.3; Sola, Deray, Atchuthan, "A micro Lie theory for state estimation in
/// robotics" (2018), section V; Bierman, "Factorization Methods for Discrete Sequential Estimation"
/// (1977).
template <Manifold X, class CovarianceForm = JosephCovariance<tangent_size<X>>>
class Estimate {
 public:
  static constexpr int size = tangent_size<X>;
  using State = X;
  using Form = CovarianceForm;
  using Noise = typename Form::Noise;
  using Tangent = TangentOf<X>;
  using Matrix = TangentMatrix<X>;
  static_assert(Form::size == size, "the covariance has a row for each entry of the state's error");

  /// @param P  The covariance of x_hat's error, in the frame of x_hat (`x_hat ⊕ e`); n x n.
  /// @errors   Those of P's maker; ArgumentError::wrong_shape, not_symmetric, not_positive,
  ///           not_finite for either; out_of_range for a P that the form cannot carry (of an
  ///           InformationForm: one that is singular).
  [[nodiscard]] static Expected<Estimate> create(const X& x_hat, const Covariance& P) {
    const auto& given = P.get();
    if (!given) {
      return tl::unexpected(given.error());
    }
    Eigen::Index n = size;
    if constexpr (size == Eigen::Dynamic) {
      n = x_hat.size();
    }
    Form form;
    const auto checks = Checks("Estimate")
                            .square(*given, "P")
                            .shape(*given, n, n, "P", "states x states")
                            .also([&]() -> Expected<void> {
                              return detail::is_usable(x_hat, x_hat)
                                         ? Expected<void>()
                                         : detail::unusable_state("Estimate", "x_hat");
                            })
                            .also([&] { return check_covariance(*given, "Estimate", "P"); })
                            .also([&]() -> Expected<void> {
                              if (form.set(Matrix(*given))) {
                                return {};
                              }
                              return detail::unusable_covariance("Estimate", "P");
                            });
    return checks.map([&] { return Estimate(x_hat, form); });
  }
  Estimate(const X& x_hat, const Form& form) noexcept : x_hat_(x_hat), form_(form) {}

  [[nodiscard]] const X& x_hat() const noexcept { return x_hat_; }
  [[nodiscard]] decltype(auto) P() const noexcept { return form_.P(); }
  [[nodiscard]] const Form& form() const noexcept { return form_; }
  /// Starts again from x_hat; P stays unless it is given.
  /// @return  Whether they were taken: what is not finite, or no covariance, is not.
  bool reset(const X& x_hat) noexcept {
    const bool usable = detail::is_usable(x_hat, x_hat_);
    if (usable) {
      x_hat_ = x_hat;
    }
    return usable;
  }
  bool reset(const X& x_hat, const Matrix& P) noexcept {
    Form form = form_;
    const bool usable = detail::is_usable(x_hat, x_hat_) && form.set(P);
    if (usable) {
      x_hat_ = x_hat;
      form_ = form;
    }
    return usable;
  }
  /// P <- factor P: the estimate is doubted. @param factor  More than 0, finite.
  bool inflate(double factor) noexcept {
    return factor == 1.0 || (factor > 0.0 && is_signal(factor) && form_.scale(factor));
  }

  /// x_hat <- next, P <- F P Fᵀ + Q (9.20, 9.21).
  /// @param next  φ(x_hat). @param F  ∂(φ(x_hat ⊕ e) ⊖ φ(x_hat))/∂e, n x n.
  /// @return  Whether both have moved: what is not finite, or would grow beyond `largest_signal`
  /// (P:
  ///          its square), stays where it is.
  bool predict(const X& next, const Matrix& F, const Noise& Q) noexcept {
    const bool moved = reset(next);
    return is_signal(F) && form_.predict(F, Q) && moved;
  }
  /// x_hat <- next, P <- Z Zᵀ + Q: what an unscented filter knows. @param Z  n x k.
  template <class Columns>
  bool assign(const X& next, const Columns& Z, const Noise& Q) noexcept {
    const bool moved = reset(next);
    return is_signal(Z) && form_.assign(Z, Q) && moved;
  }

  /// Corrects with a measurement that is linear, or has been linearised at x_hat (9.22 to 9.24).
  /// @param residual  y ⊖ h(x_hat), m x 1. @param H  ∂h(x_hat ⊕ e)/∂e, m x n.
  template <int M>
  Correction<M> correct(const Eigen::Matrix<double, M, 1>& residual,
                        const Eigen::Matrix<double, M, size>& H, const MeasurementNoise<M>& R,
                        const CorrectionOptions& options = {}) noexcept {
    Linearization<M> at{residual, H};
    CorrectionOptions once = options;
    once.iterations = 1;
    return correct_from(at, [](const Tangent&, Linearization<M>&) {}, R, once);
  }

  /// A measurement, linearised where the options' iterations want it.
  template <int M>
  struct Linearization {
    Eigen::Matrix<double, M, 1> residual;  ///< y ⊖ h(x_hat ⊕ δ), m x 1.
    Eigen::Matrix<double, M, size> H;      ///< ∂h(x_hat ⊕ δ)/∂δ, m x n.
  };
  /// Corrects with a nonlinear measurement.
  /// @param linearize  linearize(δ, at) writes `at` at x_hat ⊕ δ.
  template <int M, class Linearize>
  Correction<M> correct_by(const Linearize& linearize, const MeasurementNoise<M>& R,
                           const CorrectionOptions& options = {}) noexcept {
    Linearization<M> at;
    linearize(Tangent(Tangent::Zero(form_size())), at);
    return correct_from(at, linearize, R, options);
  }

 private:
  [[nodiscard]] Eigen::Index form_size() const noexcept {
    if constexpr (size == Eigen::Dynamic) {
      return x_hat_.size();
    } else {
      return size;
    }
  }

  /// Moves `form`, entry by entry, with R/weight. @param prior  What it is. @param delta  Takes δ.
  /// @param c  Takes ν's factors and nis, if it is there. @return  Whether S is positive definite.
  template <int M>
  bool attempt(const Form& prior, Form& form, const Eigen::Matrix<double, M, 1>& residual,
               const Eigen::Matrix<double, M, size>& H, const MeasurementNoise<M>& R, double weight,
               Tangent& delta, Correction<M>* c) const noexcept {
    Eigen::Matrix<double, M, 1> z = residual;
    Eigen::Matrix<double, M, size> rows = H;
    if (!R.is_diagonal()) {
      R.make_independent(z);
      R.make_independent(rows);
    }
    const Eigen::Index m = z.size();
    const double noisier = weight == 1.0 ? 1.0 : 1.0 / weight;
    delta.setZero(form_size());
    Tangent h = delta;
    Tangent K = delta;
    for (Eigen::Index j = 0; j < m; ++j) {
      for (Eigen::Index i = 0; i < h.size(); ++i) {
        h(i) = rows(j, i);
      }
      const double r = R.D()(j) * noisier;
      const double variance = form.correct(h, r, K);
      // Without noise, what the entries before this one have left may be rounding alone.
      constexpr double rounding = 1e-14;
      if (!(variance > 0.0) || (r == 0.0 && j > 0 && variance <= rounding * h.dot(prior.P() * h))) {
        return false;
      }
      double innovation = z(j);
      for (Eigen::Index i = 0; i < h.size() && j > 0; ++i) {
        innovation -= h(i) * delta(i);
      }
      for (Eigen::Index i = 0; i < h.size(); ++i) {
        delta(i) += K(i) * innovation;
      }
      if (c != nullptr) {
        c->D(j) = variance;
        c->nis += innovation * innovation * (1.0 / variance);
        for (Eigen::Index i = j + 1; i < m; ++i) {
          c->L(i, j) = rows.row(i).dot(K);
        }
      }
    }
    if (c != nullptr && !R.is_diagonal()) {
      c->L = (R.L() * c->L).eval();
    }
    return true;
  }

  /// Rows that are missing say nothing: y = 0 with H = 0 and a noise of their own.
  template <int M>
  static Eigen::Index leave_out_missing(Linearization<M>& at, const Eigen::Matrix<bool, M, 1>& gone,
                                        Eigen::Matrix<double, M, M>* R) noexcept {
    Eigen::Index there = 0;
    for (Eigen::Index j = 0; j < gone.size(); ++j) {
      if (!gone(j)) {
        ++there;
        continue;
      }
      at.residual(j) = 0.0;
      at.H.row(j).setZero();
      if (R != nullptr) {
        R->row(j).setZero();
        R->col(j).setZero();
        (*R)(j, j) = 1.0;
      }
    }
    return there;
  }

  template <int M, class Linearize>
  Correction<M> correct_from(Linearization<M>& at, const Linearize& linearize,
                             const MeasurementNoise<M>& noise,
                             const CorrectionOptions& options) noexcept {
    const Eigen::Index m = at.residual.size();
    Correction<M> c;
    c.entries = m;
    c.innovation = at.residual;
    c.L.setIdentity(m, m);
    c.D.setZero(m);
    if (!noise.usable() || noise.size() != m || at.H.rows() != m || at.H.cols() != form_size()) {
      c.status = UpdateStatus::invalid_noise;
      return c;
    }
    if (!options.missing_entries) {
      return corrected(c, at, linearize, noise, options);
    }
    Eigen::Matrix<bool, M, 1> gone(m);
    for (Eigen::Index j = 0; j < m; ++j) {
      gone(j) = std::isnan(at.residual(j));
    }
    Eigen::Matrix<double, M, M> R = noise.R();
    c.entries = leave_out_missing<M>(at, gone, &R);
    c.innovation = at.residual;
    if (c.entries == 0) {
      return c;
    }
    const auto again = [&](const Tangent& delta, Linearization<M>& there) {
      linearize(delta, there);
      leave_out_missing<M>(there, gone, nullptr);
    };
    return corrected(c, at, again, MeasurementNoise<M>(R), options);
  }

  template <int M, class Linearize>
  Correction<M>& corrected(Correction<M>& c, Linearization<M>& at, const Linearize& linearize,
                           const MeasurementNoise<M>& R,
                           const CorrectionOptions& options) noexcept {
    if (!is_signal(at.residual) || !is_signal(at.H)) {
      return c;
    }
    const Form prior = form_;
    Tangent delta;
    if (!attempt<M>(prior, form_, at.residual, at.H, R, 1.0, delta, &c)) {
      form_ = prior;
      c.status = UpdateStatus::singular_innovation;
      return c;
    }
    OutlierGuard* const guard = options.guard;
    double weight = 1.0;
    if (guard != nullptr) {
      weight = guard->weight(c.nis, static_cast<int>(c.entries));
      if (weight == 0.0 && guard->options().treatment == OutlierTreatment::gate) {
        form_ = prior;
        inflate(guard->judged(weight));
        c.status = UpdateStatus::rejected;
        return c;
      }
    }
    bool usable = true;
    if (weight < 1.0 || options.iterations > 1) {
      usable = iterate(prior, delta, weight, at, linearize, R, options,
                       weight < 1.0 ? guard->options().iterations : 0, static_cast<int>(c.entries));
    }
    const X next = plus(x_hat_, delta);
    if (!usable || !is_signal(delta) || !detail::is_usable(next, x_hat_)) {
      form_ = prior;
      return c;
    }
    transport(delta);
    if (guard != nullptr) {
      inflate(guard->judged(weight));
    }
    x_hat_ = next;
    c.weight = weight;
    c.status = UpdateStatus::updated;
    return c;
  }

  /// Gauss and Newton's iteration of the most probable δ, the measurement linearised and weighed
  /// anew: from the prediction each time, so that nothing is used twice.
  template <int M, class Linearize>
  bool iterate(const Form& prior, Tangent& delta, double& weight, Linearization<M>& at,
               const Linearize& linearize, const MeasurementNoise<M>& R,
               const CorrectionOptions& options, int reweightings, int entries) noexcept {
    constexpr double least_weight = 1e-12;
    constexpr double tolerance = 1e-10;
    Tangent point = Tangent::Zero(form_size());
    const int cap = std::max(options.iterations, reweightings + 1);
    weight = std::max(weight, least_weight);
    for (int k = 1; k < cap; ++k) {
      if (k < options.iterations) {
        point = delta;
        linearize(point, at);
        if (!is_signal(at.residual) || !is_signal(at.H)) {
          return false;
        }
      }
      if (k > 1 && k <= reweightings) {
        const double off = distance<M>(at.residual - at.H.lazyProduct(delta - point), R);
        weight = std::max(options.guard->weight(off, entries), least_weight);
      }
      const Tangent before = delta;
      form_ = prior;
      if (!attempt<M>(prior, form_, at.residual + at.H.lazyProduct(point), at.H, R, weight, delta,
                      nullptr)) {
        return false;
      }
      if ((delta - before).cwiseAbs().sum() <= tolerance * delta.cwiseAbs().sum()) {
        break;
      }
    }
    return true;
  }

  /// eᵀ R⁻¹ e; an entry without noise does not count.
  template <int M>
  static double distance(Eigen::Matrix<double, M, 1> e, const MeasurementNoise<M>& R) noexcept {
    R.make_independent(e);
    double sum = 0.0;
    for (Eigen::Index j = 0; j < e.size(); ++j) {
      sum += R.D()(j) > 0.0 ? e(j) * e(j) / R.D()(j) : 0.0;
    }
    return sum;
  }

  /// The covariance in the frame of the corrected state: x_hat ⊕ (δ + e) = (x_hat ⊕ δ) ⊕ Jr(δ) e.
  void transport(const Tangent& delta) noexcept {
    if constexpr (!detail::EigenVector<X> && requires { X::right_jacobian(delta); }) {
      form_.predict(X::right_jacobian(delta), Noise(Matrix(Matrix::Zero())));
    }
  }

  X x_hat_;
  Form form_;
};

/// x_hat <- A x_hat + B u, P <- A P Aᵀ + Q (9.20, 9.21) of a linear system.
/// @param u  m x 1; an input that is not a finite number counts as zero.
/// @return   Whether u was used and x_hat and P have moved.
template <class X, class Form, int Inputs>
bool predict(Estimate<X, Form>& estimate, const TangentMatrix<X>& A,
             const Eigen::Matrix<double, tangent_size<X>, Inputs>& B,
             const Eigen::Matrix<double, Inputs, 1>& u, const typename Form::Noise& Q) noexcept {
  Eigen::Matrix<double, Inputs, 1> known = u;
  detail::keep_signals(known);
  const X next = A.lazyProduct(estimate.x_hat()) + B.lazyProduct(known);
  return estimate.predict(next, A, Q) && is_signal(u);
}

/// Corrects with y = C x + v, v ~ N(0, R) (9.22 to 9.24).
/// @param y  m x 1, any number of them. @param C  m x n.
template <class X, class Form, int M>
Correction<M> correct(Estimate<X, Form>& estimate, const Eigen::Matrix<double, M, 1>& y,
                      const Eigen::Matrix<double, M, tangent_size<X>>& C,
                      const MeasurementNoise<M>& R,
                      const CorrectionOptions& options = {}) noexcept {
  return estimate.template correct<M>(y - C.lazyProduct(estimate.x_hat()), C, R, options);
}
/// The same of y = C x + D u + v.
template <class X, class Form, int M, int Inputs>
Correction<M> correct(Estimate<X, Form>& estimate, const Eigen::Matrix<double, M, 1>& y,
                      const Eigen::Matrix<double, M, tangent_size<X>>& C,
                      const Eigen::Matrix<double, M, Inputs>& D,
                      const Eigen::Matrix<double, Inputs, 1>& u, const MeasurementNoise<M>& R,
                      const CorrectionOptions& options = {}) noexcept {
  return correct<X, Form, M>(estimate, y - D.lazyProduct(u), C, R, options);
}

}  // namespace flyball
