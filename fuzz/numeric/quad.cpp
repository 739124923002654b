#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "numeric/quad.hpp"

namespace flyball::fuzz {

QuadMatrix QuadMatrix::identity(int n) {
  QuadMatrix made(n, n);
  for (int i = 0; i < n; ++i) {
    made(i, i) = 1;
  }
  return made;
}

Quad QuadMatrix::largest() const {
  Quad most = 0;
  for (const Quad x : entries_) {
    most = std::max(most, size_of(x));
  }
  return most;
}

QuadMatrix operator*(const QuadMatrix& a, const QuadMatrix& b) {
  QuadMatrix product(a.rows(), b.columns());
  for (int i = 0; i < a.rows(); ++i) {
    for (int k = 0; k < a.columns(); ++k) {
      if (a(i, k) == 0) {
        continue;
      }
      for (int j = 0; j < b.columns(); ++j) {
        product(i, j) += a(i, k) * b(k, j);
      }
    }
  }
  return product;
}

QuadMatrix operator+(QuadMatrix a, const QuadMatrix& b) {
  for (std::size_t k = 0; k < a.entries().size(); ++k) {
    a.entries()[k] += b.entries()[k];
  }
  return a;
}

QuadMatrix operator-(QuadMatrix a, const QuadMatrix& b) {
  for (std::size_t k = 0; k < a.entries().size(); ++k) {
    a.entries()[k] -= b.entries()[k];
  }
  return a;
}

QuadMatrix operator*(Quad a, QuadMatrix b) {
  for (Quad& x : b.entries()) {
    x *= a;
  }
  return b;
}

QuadMatrix transpose(const QuadMatrix& a) {
  QuadMatrix made(a.columns(), a.rows());
  for (int i = 0; i < a.rows(); ++i) {
    for (int j = 0; j < a.columns(); ++j) {
      made(j, i) = a(i, j);
    }
  }
  return made;
}

QuadMatrix magnitudes(QuadMatrix a) {
  for (Quad& x : a.entries()) {
    x = size_of(x);
  }
  return a;
}

QuadMatrix block(const QuadMatrix& a, int row, int column, int rows, int columns) {
  QuadMatrix made(rows, columns);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      made(i, j) = a(row + i, column + j);
    }
  }
  return made;
}

void put(QuadMatrix& into, int row, int column, const QuadMatrix& block) {
  for (int i = 0; i < block.rows(); ++i) {
    for (int j = 0; j < block.columns(); ++j) {
      into(row + i, column + j) = block(i, j);
    }
  }
}

QuadMatrix exponential(const QuadMatrix& a) {
  int squarings = 0;
  Quad scale = 1;
  for (Quad size = a.largest() * a.rows(); size > 0.5; size /= 2) {
    scale /= 2;
    ++squarings;
  }
  const QuadMatrix small = scale * a;
  QuadMatrix sum = QuadMatrix::identity(a.rows());
  QuadMatrix term = sum;
  for (int k = 1; k <= 24; ++k) {
    term = (Quad(1) / k) * (small * term);
    sum = std::move(sum) + term;
  }
  for (int k = 0; k < squarings; ++k) {
    sum = sum * sum;
  }
  return sum;
}

namespace {

/// P a Q = L U with the largest pivots; solves with a and with its transpose.
class Elimination {
 public:
  explicit Elimination(QuadMatrix a) : lu_(std::move(a)) {
    const int n = lu_.rows();
    for (int k = 0; k < n; ++k) {
      rows_.push_back(k);
      columns_.push_back(k);
    }
    for (int k = 0; k < n; ++k) {
      int row = k;
      int column = k;
      for (int i = k; i < n; ++i) {
        for (int j = k; j < n; ++j) {
          if (size_of(lu_(i, j)) > size_of(lu_(row, column))) {
            row = i;
            column = j;
          }
        }
      }
      if (lu_(row, column) == 0) {
        singular_ = true;
        return;
      }
      for (int j = 0; j < n; ++j) {
        std::swap(lu_(k, j), lu_(row, j));
      }
      for (int i = 0; i < n; ++i) {
        std::swap(lu_(i, k), lu_(i, column));
      }
      std::swap(rows_[static_cast<std::size_t>(k)], rows_[static_cast<std::size_t>(row)]);
      std::swap(columns_[static_cast<std::size_t>(k)], columns_[static_cast<std::size_t>(column)]);
      for (int i = k + 1; i < n; ++i) {
        lu_(i, k) /= lu_(k, k);
        for (int j = k + 1; j < n; ++j) {
          lu_(i, j) -= lu_(i, k) * lu_(k, j);
        }
      }
    }
  }

  [[nodiscard]] bool singular() const { return singular_; }

  [[nodiscard]] std::vector<Quad> solve(const std::vector<Quad>& b) const {
    const int n = lu_.rows();
    std::vector<Quad> y(b.size());
    for (int i = 0; i < n; ++i) {
      y[at(i)] = b[at(rows_[at(i)])];
      for (int j = 0; j < i; ++j) {
        y[at(i)] -= lu_(i, j) * y[at(j)];
      }
    }
    for (int i = n - 1; i >= 0; --i) {
      for (int j = i + 1; j < n; ++j) {
        y[at(i)] -= lu_(i, j) * y[at(j)];
      }
      y[at(i)] /= lu_(i, i);
    }
    return back(y, columns_);
  }

  [[nodiscard]] std::vector<Quad> solve_transposed(const std::vector<Quad>& b) const {
    const int n = lu_.rows();
    std::vector<Quad> y(b.size());
    for (int i = 0; i < n; ++i) {
      y[at(i)] = b[at(columns_[at(i)])];
      for (int j = 0; j < i; ++j) {
        y[at(i)] -= lu_(j, i) * y[at(j)];
      }
      y[at(i)] /= lu_(i, i);
    }
    for (int i = n - 1; i >= 0; --i) {
      for (int j = i + 1; j < n; ++j) {
        y[at(i)] -= lu_(j, i) * y[at(j)];
      }
    }
    return back(y, rows_);
  }

 private:
  static std::size_t at(int k) { return static_cast<std::size_t>(k); }
  static std::vector<Quad> back(const std::vector<Quad>& y, const std::vector<int>& order) {
    std::vector<Quad> x(y.size());
    for (std::size_t k = 0; k < y.size(); ++k) {
      x[at(order[k])] = y[k];
    }
    return x;
  }

  QuadMatrix lu_;
  std::vector<int> rows_;
  std::vector<int> columns_;
  bool singular_ = false;
};

Quad largest_of(const std::vector<Quad>& x) {
  Quad most = 0;
  for (const Quad entry : x) {
    most = std::max(most, size_of(entry));
  }
  return most;
}

}  // namespace

Quad smallest_singular_value(QuadMatrix a) {
  const auto n = static_cast<std::size_t>(a.rows());
  const Elimination factors(std::move(a));
  if (factors.singular()) {
    return 0;
  }
  std::vector<Quad> x(n);
  for (std::size_t k = 0; k < n; ++k) {
    x[k] = Quad(1) + Quad(static_cast<int>(k * k % 7)) / 8;
  }
  Quad smallest = 0;
  for (int turn = 0; turn < 3; ++turn) {
    const std::vector<Quad> y = factors.solve_transposed(x);
    const Quad before = largest_of(y);
    x = factors.solve(y);
    const Quad growth = largest_of(x) / before;
    smallest = Quad(1) / growth;
    for (Quad& entry : x) {
      entry /= growth * before;
    }
  }
  return smallest;
}

QuadMatrix quad_matrix(const nlohmann::json& value) {
  if (value.is_number()) {
    QuadMatrix one(1, 1);
    one(0, 0) = value.get<double>();
    return one;
  }
  const int rows = static_cast<int>(value.size());
  const int columns = rows == 0 ? 0 : static_cast<int>(value[0].size());
  QuadMatrix made(rows, columns);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      made(i, j) = value[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)].get<double>();
    }
  }
  return made;
}

double Balance::defect() const {
  const Quad left = value.largest();
  if (left == 0) {
    return 0.0;
  }
  const Quad of = terms.largest();
  const Quad ratio = left / of;
  return ratio < std::numeric_limits<double>::max() ? static_cast<double>(ratio)
                                                    : std::numeric_limits<double>::infinity();
}

Balance answered(const QuadMatrix& given) {
  Balance made(given);
  // Half a unit of the last place of a subnormal is not lost for want of care: beside a defect of
  // 1e-10 it stands as a term of 1e10 of them.
  for (Quad& term : made.terms.entries()) {
    term += Quad(std::numeric_limits<double>::denorm_min()) * 1e10;
  }
  return made;
}

Balance operator*(const Balance& a, const Balance& b) {
  return {a.value * b.value, a.terms * b.terms};
}
Balance operator+(const Balance& a, const Balance& b) {
  return {a.value + b.value, a.terms + b.terms};
}
Balance operator-(const Balance& a, const Balance& b) {
  return {a.value - b.value, a.terms + b.terms};
}
Balance transpose(const Balance& a) {
  return {transpose(a.value), transpose(a.terms)};
}

}  // namespace flyball::fuzz
