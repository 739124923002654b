// Moré, Garbow, Hillstrom, "Testing Unconstrained Optimization Software", ACM TOMS 7 (1981): the
// problems' numbers are those of its section 3, and so are the minima.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "optimization/formula_residuals.hpp"

namespace flyball::optimization::more_garbow_hillstrom_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Problem {
  std::string name;
  std::vector<std::string> formulas;
  std::vector<double> start;
  std::vector<double> minima;  ///< Σ r²; a minimum at infinity as its infimum.
  std::vector<std::string> columns{};
  std::vector<std::vector<double>> rows{};
  int farthest = 100;  ///< The start is multiplied by 1, 10, 100 up to here.
};

LeastSquaresProblem built(const Problem& problem, double factor) {
  MatrixXd data(problem.columns.empty() ? 1 : static_cast<Index>(problem.rows.size()),
                static_cast<Index>(problem.columns.size()));
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    for (std::size_t j = 0; j < problem.columns.size(); ++j) {
      data(static_cast<Index>(i), static_cast<Index>(j)) = problem.rows[i][j];
    }
  }
  LeastSquaresProblem made;
  made.start = factor * Eigen::Map<const VectorXd>(problem.start.data(),
                                                   static_cast<Index>(problem.start.size()));
  made.blocks = {std::make_shared<FormulaBlock>(
      problem.formulas, numbered("x", problem.start.size()), problem.columns, data)};
  return made;
}

/// Rows (i, …) for i = 1 … count.
template <class Row>
std::vector<std::vector<double>> rows(int count, const Row& row) {
  std::vector<std::vector<double>> all;
  for (int i = 1; i <= count; ++i) {
    all.push_back(row(i));
  }
  return all;
}

std::vector<Problem> problems() {
  const std::vector<double> bard{0.14, 0.18, 0.22, 0.25, 0.29, 0.32, 0.35, 0.39,
                                 0.37, 0.58, 0.73, 0.96, 1.34, 2.10, 4.39};
  const std::vector<double> gauss{0.0009, 0.0044, 0.0175, 0.0540, 0.1295, 0.2420, 0.3521, 0.3989,
                                  0.3521, 0.2420, 0.1295, 0.0540, 0.0175, 0.0044, 0.0009};
  std::string watson_value;
  std::string watson_slope;
  for (int j = 1; j <= 6; ++j) {
    const std::string x = "x" + std::to_string(j);
    watson_value += (j > 1 ? " + " : "") + x + "*t^" + std::to_string(j - 1);
    if (j > 1) {
      watson_slope +=
          (j > 2 ? " + " : "") + std::to_string(j - 1) + "*" + x + "*t^" + std::to_string(j - 2);
    }
  }
  std::vector<std::string> trigonometric;
  std::vector<std::string> almost_linear;
  std::string cosines;
  std::string sum;
  std::string product;
  for (int j = 1; j <= 10; ++j) {
    const std::string x = "x" + std::to_string(j);
    cosines += (j > 1 ? " + cos(" : "cos(") + x + ")";
    sum += (j > 1 ? " + " : "") + x;
    product += (j > 1 ? "*" : "") + x;
  }
  for (int j = 1; j <= 10; ++j) {
    const std::string x = "x" + std::to_string(j);
    trigonometric.push_back("10 - (" + cosines + ") + " + std::to_string(j) + "*(1 - cos(" + x +
                            ")) - sin(" + x + ")");
    almost_linear.push_back(j < 10 ? x + " + " + sum + " - 11" : product + " - 1");
  }
  return {
      {"Rosenbrock", {"10*(x2 - x1^2)", "1 - x1"}, {-1.2, 1.0}, {0.0}},
      {"Freudenstein and Roth",
       {"-13 + x1 + ((5 - x2)*x2 - 2)*x2", "-29 + x1 + ((x2 + 1)*x2 - 14)*x2"},
       {0.5, -2.0},
       {0.0, 48.98425367}},
      {"Powell badly scaled",
       {"1e4*x1*x2 - 1", "exp(-x1) + exp(-x2) - 1.0001"},
       {0, 1},
       {0.0},
       {},
       {},
       10},
      {"Brown badly scaled", {"x1 - 1e6", "x2 - 2e-6", "x1*x2 - 2"}, {1, 1}, {0.0}},
      {"Beale",
       {"1.5 - x1*(1 - x2)", "2.25 - x1*(1 - x2^2)", "2.625 - x1*(1 - x2^3)"},
       {1, 1},
       {0.0},
       {},
       {},
       1},  // From farther starts the infimum 0.452 towards x2 → -∞ is approached.
      {"Jennrich and Sampson",
       {"2 + 2*i - (exp(i*x1) + exp(i*x2))"},
       {0.3, 0.4},
       {124.3621824},
       {"i"},
       rows(10, [](int i) { return std::vector<double>{double(i)}; }),
       1},
      {"Helical valley",
       {"10*(x3 - 10*(atan(x2/x1)/(2*pi) + if(x1 < 0, 0.5, 0)))", "10*(sqrt(x1^2 + x2^2) - 1)",
        "x3"},
       {-1, 0, 0},
       {0.0}},
      {"Bard",
       {"y - (x1 + u/(v*x2 + w*x3))"},
       {1, 1, 1},
       {8.214877306e-3},
       {"u", "v", "w", "y"},
       rows(15,
            [&](int i) {
              return std::vector<double>{double(i), 16.0 - i, std::min(double(i), 16.0 - i),
                                         bard[static_cast<std::size_t>(i - 1)]};
            }),
       1},  // From farther ones 17.4287, at infinity.
      {"Gaussian",
       {"x1*exp(-x2*(t - x3)^2/2) - y"},
       {0.4, 1, 0},
       {1.127932770e-8},
       {"t", "y"},
       rows(15,
            [&](int i) {
              return std::vector<double>{0.5 * (8 - i), gauss[static_cast<std::size_t>(i - 1)]};
            }),
       1},
      {"Gulf research",
       {"exp(-abs(y - x2)^x3/x1) - t"},
       {5, 2.5, 0.15},
       {0.0},
       {"t", "y"},
       rows(99,
            [](int i) {
              const double t = 0.01 * i;
              return std::vector<double>{t, 25.0 + std::pow(-50.0 * std::log(t), 2.0 / 3.0)};
            }),
       1},
      {"Box three-dimensional",
       {"exp(-t*x1) - exp(-t*x2) - x3*(exp(-t) - exp(-10*t))"},
       {0, 10, 20},
       {0.0},
       {"t"},
       rows(10, [](int i) { return std::vector<double>{0.1 * i}; }),
       1},
      {"Powell singular",
       {"x1 + 10*x2", "sqrt(5)*(x3 - x4)", "(x2 - 2*x3)^2", "sqrt(10)*(x1 - x4)^2"},
       {3, -1, 0, 1},
       {0.0}},
      {"Wood",
       {"10*(x2 - x1^2)", "1 - x1", "sqrt(90)*(x4 - x3^2)", "1 - x3", "sqrt(10)*(x2 + x4 - 2)",
        "(x2 - x4)/sqrt(10)"},
       {-3, -1, -3, -1},
       {0.0}},
      {"Brown and Dennis",
       {"(x1 + t*x2 - exp(t))^2 + (x3 + x4*sin(t) - cos(t))^2"},
       {25, 5, -5, -1},
       {85822.20163},
       {"t"},
       rows(20, [](int i) { return std::vector<double>{0.2 * i}; })},
      {"Biggs EXP6",
       {"x3*exp(-t*x1) - x4*exp(-t*x2) + x6*exp(-t*x5) - y"},
       {1, 2, 1, 1, 1, 1},
       {0.0, 5.655649925e-3},
       {"t", "y"},
       rows(13,
            [](int i) {
              const double t = 0.1 * i;
              return std::vector<double>{
                  t, std::exp(-t) - 5.0 * std::exp(-10.0 * t) + 3.0 * std::exp(-4.0 * t)};
            }),
       1},
      {"Watson, 6 variables",
       // Of the two last residuals, x1 and x2 - x1² - 1, each stands in a row where its flag is 1.
       {"if(last == 0, " + watson_slope + " - (" + watson_value +
        ")^2 - 1, if(last == 1, x1, x2 - x1^2 - 1))"},
       {0, 0, 0, 0, 0, 0},
       {2.287670053e-3},
       {"t", "last"},
       rows(31, [](int i) { return std::vector<double>{i / 29.0, std::max(0.0, i - 29.0)}; })},
      {"Trigonometric",
       trigonometric,
       std::vector<double>(10, 0.1),
       {0.0, 2.795056122e-5},
       {},
       {},
       1},
      {"Brown almost-linear", almost_linear, std::vector<double>(10, 0.5), {0.0, 1.0}, {}, {}, 1},
  };
}

TEST(MoreGarbowHillstrom, AMinimumIsReachedFromNearAndFar) {
  for (const Problem& problem : problems()) {
    for (const double factor : {1.0, 10.0, 100.0}) {
      if (factor > problem.farthest) {
        continue;
      }
      SCOPED_TRACE(problem.name + " from " + std::to_string(int(factor)) + " times its start");
      const auto result = solve_least_squares(built(problem, factor), {.max_iterations = 5000});
      if (!result) {
        ADD_FAILURE() << to_string(result.error());
        continue;
      }
      if (std::getenv("FLYBALL_PRINT") != nullptr) {
        std::printf("%-22s x%3.0f: %4d iterations, %s, optimality %.1e, cost %.10g\n",
                    problem.name.c_str(), factor, result->iterations,
                    std::string(to_string(result->stop)).c_str(), result->optimality, result->cost);
      }
      EXPECT_TRUE(result->converged) << to_string(result->stop) << " at " << result->optimality;
      EXPECT_TRUE(std::any_of(problem.minima.begin(), problem.minima.end(), [&](double minimum) {
        return minimum == 0.0 ? result->cost < 1e-16 * std::max(1.0, result->start_cost)
                              : std::abs(result->cost / minimum - 1.0) < 1e-8;
      })) << result->cost;
    }
  }
}

// Problems 33 and 34, rank 1: r_i = i Σ j x_j - 1; and with the first and the last row and column
// zero but for the constant. The minima are m(m - 1)/(2(2m + 1)) and (m² + 3m - 6)/(2(2m - 3)).
TEST(MoreGarbowHillstrom, LinearFunctionsOfRankOneSaySo) {
  constexpr int m = 10;
  const auto counted = rows(m, [](int i) { return std::vector<double>{double(i)}; });
  const auto full = solve_least_squares(built({"33",
                                               {"i*(x1 + 2*x2 + 3*x3 + 4*x4 + 5*x5) - 1"},
                                               std::vector<double>(5, 1.0),
                                               {},
                                               {"i"},
                                               counted},
                                              1.0));
  ASSERT_TRUE(full);
  EXPECT_TRUE(full->converged);
  EXPECT_NEAR(full->cost, m * (m - 1) / (2.0 * (2 * m + 1)), 1e-13);
  EXPECT_EQ(full->rank, 1);
  EXPECT_EQ(full->undetermined.cols(), 4);
  const auto zeros =
      solve_least_squares(built({"34",
                                 {"if(i > 1 and i < 10, (i - 1)*(2*x2 + 3*x3 + 4*x4), 0) - 1"},
                                 std::vector<double>(5, 1.0),
                                 {},
                                 {"i"},
                                 counted},
                                1.0));
  ASSERT_TRUE(zeros);
  EXPECT_TRUE(zeros->converged);
  EXPECT_NEAR(zeros->cost, (m * m + 3 * m - 6) / (2.0 * (2 * m - 3)), 1e-13);
  EXPECT_EQ(zeros->rank, 1);
  EXPECT_EQ(zeros->reciprocal_condition, 0.0);
}

}  // namespace
}  // namespace flyball::optimization::more_garbow_hillstrom_test
