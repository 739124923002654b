#include <cmath>
#include <limits>
#include <utility>

#include "math/dense/dense.hpp"
#include "math/verified/form_matrix.hpp"

namespace flyball::detail {

namespace {

double row_sum_norm(const FormMatrix& H) {
  double largest = 0.0;
  for (Eigen::Index i = 0; i < H.rows(); ++i) {
    double sum = 0.0;
    for (Eigen::Index j = 0; j < H.cols(); ++j) {
      sum += H(i, j).magnitude();
    }
    if (!std::isfinite(sum)) {
      return std::numeric_limits<double>::infinity();
    }
    largest = std::max(largest, sum * inflation);
  }
  return largest;
}

}  // namespace

FormMatrix::FormMatrix(const Eigen::MatrixXd& exact) : FormMatrix(exact.rows(), exact.cols()) {
  for (Eigen::Index i = 0; i < rows_; ++i) {
    for (Eigen::Index j = 0; j < columns_; ++j) {
      (*this)(i, j) = TaylorForm(exact(i, j));
    }
  }
}

FormMatrix FormMatrix::identity(Eigen::Index size) {
  FormMatrix I(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    I(i, i) = TaylorForm(1.0);
  }
  return I;
}

FormMatrix FormMatrix::block(Eigen::Index i, Eigen::Index j, Eigen::Index rows,
                             Eigen::Index columns) const {
  FormMatrix part(rows, columns);
  for (Eigen::Index r = 0; r < rows; ++r) {
    for (Eigen::Index c = 0; c < columns; ++c) {
      part(r, c) = (*this)(i + r, j + c);
    }
  }
  return part;
}

FormMatrix operator*(const FormMatrix& A, const FormMatrix& B) {
  FormMatrix C(A.rows(), B.cols());
  for (Eigen::Index i = 0; i < C.rows(); ++i) {
    for (Eigen::Index j = 0; j < C.cols(); ++j) {
      TaylorForm sum;
      for (Eigen::Index k = 0; k < A.cols(); ++k) {
        sum = sum + A(i, k) * B(k, j);
      }
      C(i, j) = sum;
    }
  }
  return C;
}

FormMatrix operator*(const TaylorForm& factor, FormMatrix A) {
  for (Eigen::Index i = 0; i < A.rows(); ++i) {
    for (Eigen::Index j = 0; j < A.cols(); ++j) {
      A(i, j) = factor * A(i, j);
    }
  }
  return A;
}

FormMatrix operator+(FormMatrix A, const FormMatrix& B) {
  for (Eigen::Index i = 0; i < A.rows(); ++i) {
    for (Eigen::Index j = 0; j < A.cols(); ++j) {
      A(i, j) = A(i, j) + B(i, j);
    }
  }
  return A;
}

FormMatrix operator-(FormMatrix A, const FormMatrix& B) {
  return std::move(A) + TaylorForm(-1.0) * B;
}

std::optional<FormMatrix> exponential(const FormMatrix& H) {
  constexpr double small = 0.25;
  constexpr int terms = 12;
  constexpr int most_squarings = 24;
  double norm = row_sum_norm(H);
  int squarings = 0;
  while (norm > small && squarings <= most_squarings) {
    norm *= 0.5;
    ++squarings;
  }
  if (!(norm <= small)) {
    return std::nullopt;
  }
  const FormMatrix scaled = TaylorForm(std::ldexp(1.0, -squarings)) * H;
  const FormMatrix I = FormMatrix::identity(H.rows());
  FormMatrix sum = I;
  for (int k = terms; k >= 1; --k) {
    FormMatrix next = scaled * sum;
    for (Eigen::Index i = 0; i < next.rows(); ++i) {
      for (Eigen::Index j = 0; j < next.cols(); ++j) {
        next(i, j) = next(i, j) / static_cast<double>(k);
      }
    }
    sum = I + next;
  }
  // Σ_{k > K} x^k/k! <= x^{K+1}/(K+1)! / (1 - x/(K+2)) with x <= 1/4.
  double rest = 1.0;
  for (int k = 1; k <= terms + 1; ++k) {
    rest *= norm / k;
  }
  rest *= 1.05;
  for (Eigen::Index i = 0; i < sum.rows(); ++i) {
    for (Eigen::Index j = 0; j < sum.cols(); ++j) {
      sum(i, j).widen(rest);
    }
  }
  for (; squarings > 0; --squarings) {
    sum = sum * sum;
  }
  return std::isfinite(row_sum_norm(sum)) ? std::optional(std::move(sum)) : std::nullopt;
}

std::optional<FormMatrix> solve(const FormMatrix& E, const FormMatrix& F) {
  const Eigen::Index n = E.rows();
  Eigen::MatrixXd centre(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      centre(i, j) = E(i, j).centre;
    }
  }
  const Eigen::MatrixXd near = solve_linear(centre, Eigen::MatrixXd::Identity(n, n));
  if (!near.allFinite()) {
    return std::nullopt;
  }
  FormMatrix A = FormMatrix(near) * E;
  FormMatrix X = FormMatrix(near) * F;
  for (Eigen::Index k = 0; k < n; ++k) {
    if (!separated_from_zero(A(k, k))) {
      return std::nullopt;
    }
    const TaylorForm pivot = reciprocal(A(k, k));
    for (Eigen::Index i = 0; i < n; ++i) {
      if (i == k || (A(i, k).centre == 0.0 && A(i, k).deviation() == 0.0)) {
        continue;
      }
      const TaylorForm factor = A(i, k) * pivot;
      for (Eigen::Index j = k + 1; j < n; ++j) {
        A(i, j) = A(i, j) - factor * A(k, j);
      }
      for (Eigen::Index j = 0; j < X.cols(); ++j) {
        X(i, j) = X(i, j) - factor * X(k, j);
      }
    }
    for (Eigen::Index j = k + 1; j < n; ++j) {
      A(k, j) = A(k, j) * pivot;
    }
    for (Eigen::Index j = 0; j < X.cols(); ++j) {
      X(k, j) = X(k, j) * pivot;
    }
    // The row k is now of an identity's pivot.
    A(k, k) = TaylorForm(1.0);
  }
  return X;
}

Eigen::MatrixXd MatrixFamily::vertex(unsigned signs) const {
  Eigen::MatrixXd M = centre;
  for (std::size_t i = 0; i < slopes.size(); ++i) {
    if (((signs >> i) & 1u) != 0u) {
      M += slopes[i];
    } else {
      M -= slopes[i];
    }
  }
  return M;
}

MatrixFamily family_of(const FormMatrix& A) {
  MatrixFamily family;
  family.centre.resize(A.rows(), A.cols());
  family.radius.resize(A.rows(), A.cols());
  const auto entries = [&](auto&& part) {
    Eigen::MatrixXd M(A.rows(), A.cols());
    for (Eigen::Index i = 0; i < A.rows(); ++i) {
      for (Eigen::Index j = 0; j < A.cols(); ++j) {
        M(i, j) = part(A(i, j));
      }
    }
    return M;
  };
  family.centre = entries([](const TaylorForm& x) { return x.centre; });
  family.radius = entries([](const TaylorForm& x) { return x.radius; });
  for (std::size_t k = 0; k < most_parameters; ++k) {
    Eigen::MatrixXd slope = entries([&](const TaylorForm& x) { return x.slope[k]; });
    if (!slope.isZero(0.0)) {
      family.slopes.push_back(std::move(slope));
      family.parameters.push_back(static_cast<int>(k));
    }
  }
  for (std::size_t j = 0; j < most_parameters; ++j) {
    for (std::size_t i = 0; i <= j; ++i) {
      Eigen::MatrixXd square =
          entries([&](const TaylorForm& x) { return x.square[square_index(i, j)]; });
      if (square.isZero(0.0)) {
        continue;
      }
      if (i == j) {
        // ε² is in [0, 1]: half a square about its middle.
        square *= 0.5;
        family.centre += square;
        family.radius += unit_roundoff * family.centre.cwiseAbs();
        family.radius = (family.radius * inflation).eval();
        family.radius.array() += underflow;
      }
      family.squares.push_back(std::move(square));
      family.pairs.push_back({static_cast<int>(i), static_cast<int>(j)});
    }
  }
  return family;
}

}  // namespace flyball::detail
