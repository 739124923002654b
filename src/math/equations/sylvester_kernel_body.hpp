#pragma once

// The kernel of sylvester_kernel.hpp for one instruction set; see riccati_kernel_body.hpp.

#include "math/dense/balance_small.hpp"
#include "math/dense/real_schur.hpp"
#include "math/dense/shifted_hessenberg.hpp"
#include "math/dense/small_matrix.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

/// A = U H Uᵀ upper Hessenberg, B = V T Vᵀ in real Schur form: column by column of Y = UᵀXV, two
/// for a block of two complex eigenvalues, H Y + Y T = UᵀFV is a shifted Hessenberg system (Golub,
/// Nash and Van Loan, IEEE Trans. Automatic Control 24 (1979)).
class HessenbergSchur {
 public:
  HessenbergSchur(const SylvesterData& data, SylvesterAnswer& answer, double* memory)
      : data_(data),
        answer_(answer),
        lyapunov_(data.B == nullptr),
        swapped_(!lyapunov_ && data.columns > data.rows),
        n_(swapped_ ? data.columns : data.rows),
        m_(swapped_ ? data.rows : data.columns),
        lda_(padded_rows(n_)),
        ldb_(padded_rows(m_)) {
    Workspace work(memory);
    for (double** matrix : {&A_, &H_, &U_, &Ut_}) {
      *matrix = work.take(lda_ * n_);
    }
    for (double** matrix : {&B_, &T_, &V_, &Vt_}) {
      *matrix = work.take(ldb_ * m_);
    }
    for (double** matrix : {&F_, &X_, &R_, &first_, &second_}) {
      *matrix = work.take(lda_ * m_);
    }
    Y_ = work.take(3 * lda_ * m_);  // the residual takes `first_`, `second_` and a part of this
    known_ = work.take(6 * lda_);
    vectors_ = work.take(6 * std::max(lda_, ldb_));
    da_ = work.take(lda_);
    db_ = work.take(ldb_);
  }

  bool run() {
    load();
    if (!factorize()) {
      return false;
    }
    double gain = 0.0;
    if (!solve_first(gain)) {
      return false;
    }
    double previous = std::numeric_limits<double>::infinity();
    for (int pass = 0;; ++pass) {
      sylvester_residual({n_, m_, data_.continuous, data_.symmetric, A_, B_, F_}, X_, R_, first_);
      transform(R_, Y_, lda_);
      if (!solve_transformed<1>()) {
        return false;
      }
      transform_back(Y_, lda_, R_);
      double step = 0.0;
      double size = 0.0;
      for (int k = 0; k < lda_ * m_; ++k) {
        X_[k] += R_[k];
      }
      step = std::sqrt(sum_of_squares(R_));
      size = std::sqrt(sum_of_squares(X_));
      if (data_.symmetric) {
        symmetrize();
      }
      if (!(step < 0.5 * previous) || !std::isfinite(size) || pass == 3) {
        return false;
      }
      // The next step would be as much smaller than this one as this one is than X.
      if (step <= 1e-12 * size) {
        measure(gain, size);
        break;
      }
      previous = step;
    }
    // Beyond, two eigenvalues may cancel but for rounding.
    if (!(answer_.condition < 1e9) || left_ > 1e-6 || !holds_by_entries()) {
      return false;
    }
    for (int j = 0; j < m_; ++j) {
      for (int i = 0; i < n_; ++i) {
        const double x = X_[i + j * lda_] * (da_[i] / db_[j]);
        answer_.X[swapped_ ? j + i * m_ : i + j * n_] = x;
      }
    }
    return true;
  }

 private:
  [[nodiscard]] static Size<0> rows(int ld) { return {ld}; }

  [[nodiscard]] double sum_of_squares(const double* M) const {
    return squared_norm(rows(lda_), M, m_);
  }

  static void load_square(int n, int ld, const double* from, bool transposed, double* to, double* d,
                          double* vectors) {
    for (int k = 0; k < ld * n; ++k) {
      to[k] = 0.0;
    }
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        to[i + j * ld] = transposed ? from[j + i * n] : from[i + j * n];
      }
    }
    for (int i = 0; i < ld; ++i) {
      d[i] = 1.0;
    }
    if (n > 1 && (n == 2 || !is_balanced(Size<0>{n}, to, vectors, vectors + ld))) {
      balance_columns(n, to, ld, d);
    }
  }

  /// A ← Da⁻¹ADa, B ← Db⁻¹BDb, F ← Da⁻¹FDb; the transposed equation where it is wide.
  void load() {
    load_square(n_, lda_, swapped_ ? data_.B : data_.A, swapped_, A_, da_, vectors_);
    if (lyapunov_) {
      transpose_of(n_, lda_, A_, B_, ldb_);
      for (int i = 0; i < ldb_; ++i) {
        db_[i] = 1.0 / da_[i];
      }
    } else {
      load_square(m_, ldb_, swapped_ ? data_.A : data_.B, swapped_, B_, db_, vectors_);
    }
    for (int j = 0; j < m_; ++j) {
      for (int i = 0; i < lda_; ++i) {
        const double f = i >= n_ ? 0.0 : (swapped_ ? data_.F[j + i * m_] : data_.F[i + j * n_]);
        F_[i + j * lda_] = i >= n_ ? 0.0 : f * (db_[j] / da_[i]);
      }
    }
  }

  static void transpose_of(int n, int ld, const double* M, double* to, int ld_to) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        to[i + j * ld_to] = M[j + i * ld];
      }
      for (int i = n; i < ld_to; ++i) {
        to[i + j * ld_to] = 0.0;
      }
    }
  }

  bool factorize() {
    for (int k = 0; k < lda_ * n_; ++k) {
      H_[k] = A_[k];
    }
    hessenberg(n_, lda_, H_, U_, vectors_);
    if (lyapunov_) {
      if (!real_schur(n_, lda_, H_, U_)) {
        return false;
      }
      // Of Aᵀ, the order reversed so that it is upper triangular again.
      for (int j = 0; j < n_; ++j) {
        for (int i = 0; i < n_; ++i) {
          T_[i + j * ldb_] = H_[(n_ - 1 - j) + (n_ - 1 - i) * lda_];
          V_[i + j * ldb_] = U_[i + (n_ - 1 - j) * lda_];
        }
        for (int i = n_; i < ldb_; ++i) {
          T_[i + j * ldb_] = 0.0;
          V_[i + j * ldb_] = 0.0;
        }
      }
    } else {
      for (int k = 0; k < ldb_ * m_; ++k) {
        T_[k] = B_[k];
      }
      hessenberg(m_, ldb_, T_, V_, vectors_);
      if (!real_schur(m_, ldb_, T_, V_)) {
        return false;
      }
    }
    transpose_of(n_, lda_, U_, Ut_, lda_);
    transpose_of(m_, ldb_, V_, Vt_, ldb_);
    return true;
  }

  /// Y ← UᵀFV.
  void transform(const double* F, double* Y, int ldy) {
    multiply(rows(lda_), first_, lda_, F, lda_, V_, ldb_, m_, m_);
    multiply(rows(lda_), Y, ldy, Ut_, lda_, first_, lda_, n_, m_);
  }
  /// X ← UYVᵀ.
  void transform_back(const double* Y, int ldy, double* X) {
    multiply(rows(lda_), first_, lda_, Y, ldy, Vt_, ldb_, m_, m_);
    multiply(rows(lda_), X, lda_, U_, lda_, first_, lda_, n_, m_);
  }

  /// X, and ‖L⁻¹‖ from two matrices of signs, which no direction is orthogonal to.
  bool solve_first(double& gain) {
    const int ld = 3 * lda_;
    transform(F_, Y_, ld);
    for (int j = 0; j < m_; ++j) {
      for (int s = 0; s < 2; ++s) {
        double* const signs = Y_ + j * ld + (s + 1) * lda_;
        const int stride = s == 0 ? 1 : 3;
        for (int i = 0; i < lda_; ++i) {
          const int k = i + j * n_;
          signs[i] = i >= n_ ? 0.0 : ((k * stride + k / 5) % 2 == 0 ? 1.0 : -1.0);
        }
      }
    }
    if (!solve_transformed<3>()) {
      return false;
    }
    double sums[2] = {};
    for (int j = 0; j < m_; ++j) {
      for (int s = 0; s < 2; ++s) {
        sums[s] += squared_norm(rows(lda_), Y_ + j * ld + (s + 1) * lda_, 1);
      }
    }
    gain = std::sqrt(std::max(sums[0], sums[1]) / (static_cast<double>(n_) * m_));
    transform_back(Y_, ld, X_);
    if (data_.symmetric) {
      symmetrize();
    }
    return std::isfinite(gain);
  }

  /// C (height x 1) = or -= A B, height a whole number of vectors, for tall A.
  template <Product Kind>
  static void column_product(int height, double* C, const double* A, int lda, const double* B,
                             int depth) {
    int i = 0;
    for (; i + 32 <= height; i += 32) {
      product_tile<Vector4, 8, 1, Kind>(C + i, 0, A + i, lda, B, 0, depth);
    }
    for (; i + 16 <= height; i += 16) {
      product_tile<Vector4, 4, 1, Kind>(C + i, 0, A + i, lda, B, 0, depth);
    }
    for (; i < height; i += 4) {
      product_tile<Vector4, 1, 1, Kind>(C + i, 0, A + i, lda, B, 0, depth);
    }
  }

  /// Y ← the Y of H Y + Y T = Y, or H Y T - Y = Y, of R matrices, the columns of each beside the
  /// others'.
  template <int R>
  bool solve_transformed() {
    const int ld = R * lda_;
    const bool continuous = data_.continuous;
    for (int j = 0; j < m_;) {
      const int width = j + 1 < m_ && T_[j + 1 + j * ldb_] != 0.0 ? 2 : 1;
      double* const y = Y_ + j * ld;
      if (j > 0) {
        for (int k = 0; k < width; ++k) {
          const double* const t = T_ + (j + k) * ldb_;
          if (continuous) {
            column_product<Product::subtract>(ld, y + k * ld, Y_, ld, t, j);
          } else {
            column_product<Product::assign>(ld, known_ + k * ld, Y_, ld, t, j);
          }
        }
        if (!continuous) {
          multiply<0, Product::subtract>(rows(lda_), y, lda_, H_, lda_, known_, lda_, n_,
                                         R * width);
        }
      }
      if (width == 1) {
        const double t = T_[j + j * ldb_];
        if (!solve_shifted<R>(n_, lda_, H_, continuous ? 1.0 : t, continuous ? t : -1.0, y,
                              vectors_)) {
          return false;
        }
      } else {
        // (y1 y2)[a b; c a] for w = y1 + i f y2, f = ω/b, is w(a + iω), ω² = -bc.
        const double a = T_[j + j * ldb_];
        const double b = T_[j + (j + 1) * ldb_];
        const double c = T_[j + 1 + j * ldb_];
        const double omega = std::sqrt(-b * c);
        const double f = omega / b;
        if (!(omega > 0.0) || !std::isfinite(f)) {
          return false;
        }
        for (int i = 0; i < ld; ++i) {
          y[i + ld] *= f;
        }
        const Pair lambda{a, omega};
        if (!solve_shifted<R>(n_, lda_, H_, continuous ? Pair{1.0, 0.0} : lambda,
                              continuous ? lambda : Pair{-1.0, 0.0}, y, y + ld, vectors_)) {
          return false;
        }
        const double inverse = 1.0 / f;
        for (int i = 0; i < ld; ++i) {
          y[i + ld] *= inverse;
        }
      }
      j += width;
    }
    return true;
  }

  void symmetrize() {
    for (int j = 0; j < m_; ++j) {
      for (int i = 0; i < j; ++i) {
        X_[i + j * lda_] = X_[j + i * lda_] = 0.5 * (X_[i + j * lda_] + X_[j + i * lda_]);
      }
    }
  }

  /// What is left of the equation in working precision, beside its terms.
  void measure(double gain, double size) {
    double terms = std::sqrt(sum_of_squares(F_));
    multiply(rows(lda_), first_, lda_, X_, lda_, B_, ldb_, m_, m_);
    if (data_.continuous) {
      multiply(rows(lda_), second_, lda_, A_, lda_, X_, lda_, n_, m_);
      terms += std::sqrt(sum_of_squares(first_)) + std::sqrt(sum_of_squares(second_));
      for (int k = 0; k < lda_ * m_; ++k) {
        R_[k] = F_[k] - second_[k] - first_[k];
      }
    } else {
      multiply(rows(lda_), second_, lda_, A_, lda_, first_, lda_, n_, m_);
      terms += std::sqrt(sum_of_squares(second_)) + size;
      for (int k = 0; k < lda_ * m_; ++k) {
        R_[k] = F_[k] + X_[k] - second_[k];
      }
    }
    // Where terms cancel so far in products' sums that rounding is what they have in common, others
    // have to say whether that is an answer.
    left_ = std::sqrt(sum_of_squares(R_)) / terms;
    answer_.condition = size > 0.0 ? std::max(1.0, gain * terms / size) : gain;
  }

  /// Whether the entries that are not zero are within eight digits of each other.
  static bool alike(const double* M, int size) {
    double least = std::numeric_limits<double>::infinity();
    double most = 0.0;
    for (int k = 0; k < size; ++k) {
      const double entry = std::abs(M[k]);
      least = entry > 0.0 ? std::min(least, entry) : least;
      most = std::max(most, entry);
    }
    return most <= 1e8 * least;
  }

  /// What is left of each entry of the equation is rounding beside the terms that made it; those of
  /// an entry that are less than a thousandth of what its row and its column have elsewhere count
  /// as that: of entries that are zero nothing but rounding is there.
  bool holds_by_entries() {
    // Unless the equation's own entries are so far apart that small ones count.
    const double least =
        alike(A_, lda_ * n_) && alike(B_, ldb_ * m_) && alike(F_, lda_ * m_) ? 1e-3 : 0.0;
    const auto magnitudes = [](double* to, const double* from, int size) {
      for (int k = 0; k < size; ++k) {
        to[k] = std::abs(from[k]);
      }
    };
    magnitudes(A_, A_, lda_ * n_);
    magnitudes(B_, B_, ldb_ * m_);
    magnitudes(Y_, X_, lda_ * m_);
    multiply(rows(lda_), first_, lda_, Y_, lda_, B_, ldb_, m_, m_);
    multiply(rows(lda_), second_, lda_, A_, lda_, data_.continuous ? Y_ : first_, lda_, n_, m_);
    for (int k = 0; k < lda_ * m_; ++k) {
      second_[k] += std::abs(F_[k]) + (data_.continuous ? first_[k] : Y_[k]);
    }
    double* const columns = vectors_;
    for (int j = 0; j < m_; ++j) {
      columns[j] = 0.0;
      for (int i = 0; i < n_; ++i) {
        columns[j] = std::max(columns[j], second_[i + j * lda_]);
      }
    }
    for (int i = 0; i < n_; ++i) {
      double row = 0.0;
      for (int j = 0; j < m_; ++j) {
        row = columns[j] > 0.0 ? std::max(row, second_[i + j * lda_] / columns[j]) : row;
      }
      for (int j = 0; j < m_; ++j) {
        const int k = i + j * lda_;
        const double terms = std::max(second_[k], least * row * columns[j]);
        const double left = std::abs(R_[k]);
        if (!(left <= (16.0 + n_ + m_) * epsilon * terms)) {
          return false;
        }
        answer_.residual = left > answer_.residual * terms ? left / terms : answer_.residual;
      }
    }
    return true;
  }

  const SylvesterData& data_;
  SylvesterAnswer& answer_;
  bool lyapunov_;
  bool swapped_;
  int n_, m_, lda_, ldb_;
  double *A_, *H_, *U_, *Ut_;
  double *B_, *T_, *V_, *Vt_;
  double *F_, *X_, *R_, *first_, *second_, *Y_;
  double *known_, *vectors_, *da_, *db_;
  double left_ = 0.0;  ///< What the products of the terms leave beside their norms.
};

bool solve_sylvester(const SylvesterData& data, SylvesterAnswer& answer, double* memory) {
  return HessenbergSchur(data, answer, memory).run();
}

}  // namespace flyball::detail::FLYBALL_VARIANT
