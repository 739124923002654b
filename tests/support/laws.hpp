#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/error.hpp>

#include "support/random_systems.hpp"

namespace flyball::test {

inline constexpr double epsilon = std::numeric_limits<double>::epsilon();

/// 64 bits of mantissa: what a law is checked in, so that the check's own rounding does not count.
using LongMatrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
inline LongMatrix wide(const Eigen::MatrixXd& M) {
  return M.cast<long double>();
}

/// The largest of the defects of a law in each class, and which system has it. They are recorded as
/// properties of the test: --gtest_output=xml shows them.
class Law {
 public:
  explicit Law(std::string name) : name_(std::move(name)) {}

  void holds(long double defect, int trial, const RandomSystem& s) {
    Worst& worst = worst_[static_cast<std::size_t>(s.kind)];
    ++count_;
    // Not a number is the largest defect.
    if (defect <= worst.defect) {
      return;
    }
    worst.defect =
        std::isnan(defect) ? std::numeric_limits<double>::infinity() : static_cast<double>(defect);
    std::ostringstream text;
    text << to_string(s.kind) << ' ' << s.name << ", trial " << trial << ", n = " << s.A.rows();
    worst.where = text.str();
  }
  void expect_within(double bound, int at_least = 1) const {
    expect_within(bound, bound, at_least);
  }
  /// @param hard  For the reference cases.
  void expect_within(double bound, double hard, int at_least) const {
    for (const SystemClass kind : all_classes) {
      const Worst& worst = worst_[static_cast<std::size_t>(kind)];
      std::ostringstream number;
      number << worst.defect;
      testing::Test::RecordProperty(name_ + ": " + worst.where, number.str());
      EXPECT_LE(worst.defect, kind == SystemClass::reference ? hard : bound)
          << name_ << ": " << worst.where;
    }
    EXPECT_GE(count_, at_least) << name_;
  }

 private:
  struct Worst {
    double defect = -std::numeric_limits<double>::infinity();
    std::string where;
  };
  std::string name_;
  std::array<Worst, std::size(all_classes)> worst_;
  int count_ = 0;
};

/// Answers refused that exist.
class Refusals {
 public:
  void add(const Error& error, int trial, const RandomSystem& s) {
    EXPECT_EQ(error.kind(), ErrorKind::no_answer) << to_string(error);
    ++count_;
    std::ostringstream text;
    text << trial << ' ' << to_string(s.kind) << ' ' << s.name << " n = " << s.A.rows()
         << " coupling " << s.coupling << ": " << to_string(error) << '\n';
    list_ += text.str();
  }
  void expect_at_most(int most) const {
    testing::Test::RecordProperty("refused", count_);
    EXPECT_LE(count_, most) << list_;
  }

 private:
  int count_ = 0;
  std::string list_;
};

/// exp(A) by scaling, Taylor and squaring.
inline LongMatrix exponential(const LongMatrix& A) {
  const long double size = A.cwiseAbs().colwise().sum().maxCoeff();
  const int squarings = size > 0.25L ? static_cast<int>(std::ceil(std::log2(size))) + 2 : 0;
  const LongMatrix small = A * std::ldexp(1.0L, -squarings);
  LongMatrix sum = LongMatrix::Identity(A.rows(), A.cols());
  LongMatrix term = sum;
  for (int k = 1; k <= 17; ++k) {
    term = (small * term / k).eval();
    sum += term;
  }
  for (int k = 0; k < squarings; ++k) {
    sum = (sum * sum).eval();
  }
  return sum;
}

/// A perturbation of relative size `size` in a random direction.
inline LongMatrix nudged(const LongMatrix& M, Random& random, double size) {
  const LongMatrix G = wide(random_matrix(random, M.rows(), M.cols()));
  return M + G * (size * M.norm() / G.norm());
}

}  // namespace flyball::test
