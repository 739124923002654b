#include <cmath>
#include <numbers>
#include <string>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include <flyball/optimization/problem/problem.hpp>

// Problems of Hock and Schittkowski, "Test examples for nonlinear programming codes" (1981), by
// their numbers, from the standard starts to the published optima.

namespace {

using namespace flyball;
using namespace flyball::optimization;

constexpr double pi = std::numbers::pi;

struct Case {
  int number;
  Eigen::VectorXd start;
  double optimum;
  void (*state)(Problem& problem, const ExpressionMatrix& x);
  double other_optimum = std::nan("");  // a local minimum that is as good an answer
};

Eigen::VectorXd vector(std::initializer_list<double> values) {
  Eigen::VectorXd v(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), v.data());
  return v;
}

std::vector<Case> cases() {
  std::vector<Case> list;
  list.push_back({1, vector({-2.0, 1.0}), 0.0, [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(100.0 * pow(x(1) - pow(x(0), 2.0), 2.0) +
                                     pow(1.0 - x(0), 2.0));
                    problem.subject_to(x(1) >= -1.5);
                  }});
  list.push_back({2, vector({-2.0, 1.0}), 0.0504261879,
                  [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(100.0 * pow(x(1) - pow(x(0), 2.0), 2.0) +
                                     pow(1.0 - x(0), 2.0));
                    problem.subject_to(x(1) >= 1.5);
                  },
                  4.941229318});
  list.push_back({3, vector({10.0, 1.0}), 0.0, [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(x(1) + 1e-5 * pow(x(1) - x(0), 2.0));
                    problem.subject_to(x(1) >= 0.0);
                  }});
  list.push_back(
      {4, vector({1.125, 0.125}), 8.0 / 3.0, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(pow(x(0) + 1.0, 3.0) / 3.0 + x(1));
         problem.subject_to(x(0) >= 1.0);
         problem.subject_to(x(1) >= 0.0);
       }});
  list.push_back({5, vector({0.0, 0.0}), -(std::sqrt(3.0) / 2.0 + pi / 3.0),
                  [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(sin(x(0) + x(1)) + pow(x(0) - x(1), 2.0) - 1.5 * x(0) +
                                     2.5 * x(1) + 1.0);
                    problem.subject_to(x(0) >= -1.5);
                    problem.subject_to(x(0) <= 4.0);
                    problem.subject_to(x(1) >= -3.0);
                    problem.subject_to(x(1) <= 3.0);
                  }});
  list.push_back({6, vector({-1.2, 1.0}), 0.0, [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(pow(1.0 - x(0), 2.0));
                    problem.subject_to(10.0 * (x(1) - pow(x(0), 2.0)) == 0.0);
                  }});
  list.push_back(
      {7, vector({2.0, 2.0}), -std::sqrt(3.0), [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(log(1.0 + pow(x(0), 2.0)) - x(1));
         problem.subject_to(pow(1.0 + pow(x(0), 2.0), 2.0) + pow(x(1), 2.0) - 4.0 == 0.0);
       }});
  list.push_back({8, vector({2.0, 1.0}), -1.0, [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(-1.0);
                    problem.subject_to(pow(x(0), 2.0) + pow(x(1), 2.0) - 25.0 == 0.0);
                    problem.subject_to(x(0) * x(1) - 9.0 == 0.0);
                  }});
  list.push_back({9, vector({0.0, 0.0}), -0.5, [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(sin(pi * x(0) / 12) * cos(pi * x(1) / 16));
                    problem.subject_to(4.0 * x(0) - 3.0 * x(1) == 0.0);
                  }});
  list.push_back({10, vector({-10.0, 10.0}), -1.0, [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(x(0) - x(1));
                    problem.subject_to(
                        -3.0 * pow(x(0), 2.0) + 2.0 * x(0) * x(1) - pow(x(1), 2.0) + 1.0 >= 0.0);
                  }});
  list.push_back(
      {11, vector({4.9, 0.1}), -8.498464223, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(pow(x(0) - 5.0, 2.0) + pow(x(1), 2.0) - 25.0);
         problem.subject_to(-pow(x(0), 2.0) + x(1) >= 0.0);
       }});
  list.push_back({12, vector({0.0, 0.0}), -30.0, [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(0.5 * pow(x(0), 2.0) + pow(x(1), 2.0) - x(0) * x(1) -
                                     7.0 * x(0) - 7.0 * x(1));
                    problem.subject_to(25.0 - 4.0 * pow(x(0), 2.0) - pow(x(1), 2.0) >= 0.0);
                  }});
  list.push_back({14, vector({2.0, 2.0}), 9.0 - 2.875 * std::sqrt(7.0),
                  [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(pow(x(0) - 2.0, 2.0) + pow(x(1) - 1.0, 2.0));
                    problem.subject_to(x(0) - 2.0 * x(1) + 1.0 == 0.0);
                    problem.subject_to(-0.25 * pow(x(0), 2.0) - pow(x(1), 2.0) + 1.0 >= 0.0);
                  }});
  list.push_back({15, vector({-2.0, 1.0}), 306.5, [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(100.0 * pow(x(1) - pow(x(0), 2.0), 2.0) +
                                     pow(1.0 - x(0), 2.0));
                    problem.subject_to(x(0) * x(1) - 1.0 >= 0.0);
                    problem.subject_to(x(0) + pow(x(1), 2.0) >= 0.0);
                    problem.subject_to(x(0) <= 0.5);
                  }});
  list.push_back({16, vector({-2.0, 1.0}), 0.25,
                  [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(100.0 * pow(x(1) - pow(x(0), 2.0), 2.0) +
                                     pow(1.0 - x(0), 2.0));
                    problem.subject_to(x(0) + pow(x(1), 2.0) >= 0.0);
                    problem.subject_to(pow(x(0), 2.0) + x(1) >= 0.0);
                    problem.subject_to(x(0) >= -0.5);
                    problem.subject_to(x(0) <= 0.5);
                    problem.subject_to(x(1) <= 1.0);
                  },
                  23.14466094});
  list.push_back({17, vector({-2.0, 1.0}), 1.0, [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(100.0 * pow(x(1) - pow(x(0), 2.0), 2.0) +
                                     pow(1.0 - x(0), 2.0));
                    problem.subject_to(pow(x(1), 2.0) - x(0) >= 0.0);
                    problem.subject_to(pow(x(0), 2.0) - x(1) >= 0.0);
                    problem.subject_to(x(0) >= -0.5);
                    problem.subject_to(x(0) <= 0.5);
                    problem.subject_to(x(1) <= 1.0);
                  }});
  list.push_back({18, vector({2.0, 2.0}), 5.0, [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(0.01 * pow(x(0), 2.0) + pow(x(1), 2.0));
                    problem.subject_to(x(0) * x(1) - 25.0 >= 0.0);
                    problem.subject_to(pow(x(0), 2.0) + pow(x(1), 2.0) - 25.0 >= 0.0);
                    problem.subject_to(x(0) >= 2.0);
                    problem.subject_to(x(0) <= 50.0);
                    problem.subject_to(x(1) >= 0.0);
                    problem.subject_to(x(1) <= 50.0);
                  }});
  list.push_back(
      {19, vector({20.1, 5.84}), -6961.81381, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(pow(x(0) - 10.0, 3.0) + pow(x(1) - 20.0, 3.0));
         problem.subject_to(pow(x(0) - 5.0, 2.0) + pow(x(1) - 5.0, 2.0) - 100.0 >= 0.0);
         problem.subject_to(-pow(x(1) - 5.0, 2.0) - pow(x(0) - 6.0, 2.0) + 82.81 >= 0.0);
         problem.subject_to(x(0) >= 13.0);
         problem.subject_to(x(0) <= 100.0);
         problem.subject_to(x(1) >= 0.0);
         problem.subject_to(x(1) <= 100.0);
       }});
  list.push_back({20, vector({-2.0, 1.0}), 81.5 - 25.0 * std::sqrt(3.0),
                  [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(100.0 * pow(x(1) - pow(x(0), 2.0), 2.0) +
                                     pow(1.0 - x(0), 2.0));
                    problem.subject_to(x(0) + pow(x(1), 2.0) >= 0.0);
                    problem.subject_to(pow(x(0), 2.0) + x(1) >= 0.0);
                    problem.subject_to(pow(x(0), 2.0) + pow(x(1), 2.0) - 1.0 >= 0.0);
                    problem.subject_to(x(0) >= -0.5);
                    problem.subject_to(x(0) <= 0.5);
                  },
                  40.19872981});
  list.push_back(
      {21, vector({-1.0, -1.0}), -99.96, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(0.01 * pow(x(0), 2.0) + pow(x(1), 2.0) - 100.0);
         problem.subject_to(10.0 * x(0) - x(1) - 10.0 >= 0.0);
         problem.subject_to(x(0) >= 2.0);
         problem.subject_to(x(0) <= 50.0);
         problem.subject_to(x(1) >= -50.0);
         problem.subject_to(x(1) <= 50.0);
       }});
  list.push_back({22, vector({2.0, 2.0}), 1.0, [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(pow(x(0) - 2.0, 2.0) + pow(x(1) - 1.0, 2.0));
                    problem.subject_to(-x(0) - x(1) + 2.0 >= 0.0);
                    problem.subject_to(-pow(x(0), 2.0) + x(1) >= 0.0);
                  }});
  list.push_back({23, vector({3.0, 1.0}), 2.0, [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(pow(x(0), 2.0) + pow(x(1), 2.0));
                    problem.subject_to(x(0) + x(1) - 1.0 >= 0.0);
                    problem.subject_to(pow(x(0), 2.0) + pow(x(1), 2.0) - 1.0 >= 0.0);
                    problem.subject_to(9.0 * pow(x(0), 2.0) + pow(x(1), 2.0) - 9.0 >= 0.0);
                    problem.subject_to(pow(x(0), 2.0) - x(1) >= 0.0);
                    problem.subject_to(pow(x(1), 2.0) - x(0) >= 0.0);
                    problem.subject_to(x(0) >= -50.0);
                    problem.subject_to(x(0) <= 50.0);
                    problem.subject_to(x(1) >= -50.0);
                    problem.subject_to(x(1) <= 50.0);
                  }});
  list.push_back({24, vector({1.0, 0.5}), -1.0, [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize((pow(x(0) - 3.0, 2.0) - 9) * pow(x(1), 3.0) /
                                     (27.0 * std::sqrt(3.0)));
                    problem.subject_to(x(0) / std::sqrt(3.0) - x(1) >= 0.0);
                    problem.subject_to(x(0) + std::sqrt(3.0) * x(1) >= 0.0);
                    problem.subject_to(-x(0) - std::sqrt(3.0) * x(1) + 6.0 >= 0.0);
                    problem.subject_to(x(0) >= 0.0);
                    problem.subject_to(x(1) >= 0.0);
                  }});
  list.push_back(
      {26, vector({-2.6, 2.0, 2.0}), 0.0, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(pow(x(0) - x(1), 2.0) + pow(x(1) - x(2), 4.0));
         problem.subject_to((1.0 + pow(x(1), 2.0)) * x(0) + pow(x(2), 4.0) - 3.0 == 0.0);
       }});
  list.push_back(
      {27, vector({2.0, 2.0, 2.0}), 0.04, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(0.01 * pow(x(0) - 1.0, 2.0) + pow(x(1) - pow(x(0), 2.0), 2.0));
         problem.subject_to(x(0) + pow(x(2), 2.0) + 1.0 == 0.0);
       }});
  list.push_back(
      {28, vector({-4.0, 1.0, 1.0}), 0.0, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(pow(x(0) + x(1), 2.0) + pow(x(1) + x(2), 2.0));
         problem.subject_to(x(0) + 2.0 * x(1) + 3.0 * x(2) - 1.0 == 0.0);
       }});
  list.push_back({29, vector({1.0, 1.0, 1.0}), -16.0 * std::sqrt(2.0),
                  [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(-x(0) * x(1) * x(2));
                    problem.subject_to(-pow(x(0), 2.0) - 2.0 * pow(x(1), 2.0) -
                                           4.0 * pow(x(2), 2.0) + 48.0 >=
                                       0.0);
                  }});
  list.push_back(
      {30, vector({1.0, 1.0, 1.0}), 1.0, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(pow(x(0), 2.0) + pow(x(1), 2.0) + pow(x(2), 2.0));
         problem.subject_to(pow(x(0), 2.0) + pow(x(1), 2.0) - 1.0 >= 0.0);
         problem.subject_to(x(0) >= 1.0);
         problem.subject_to(x(0) <= 10.0);
         problem.subject_to(x(1) >= -10.0);
         problem.subject_to(x(1) <= 10.0);
         problem.subject_to(x(2) >= -10.0);
         problem.subject_to(x(2) <= 10.0);
       }});
  list.push_back(
      {31, vector({1.0, 1.0, 1.0}), 6.0, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(9.0 * pow(x(0), 2.0) + pow(x(1), 2.0) + 9.0 * pow(x(2), 2.0));
         problem.subject_to(x(0) * x(1) - 1.0 >= 0.0);
         problem.subject_to(x(0) >= -10.0);
         problem.subject_to(x(0) <= 10.0);
         problem.subject_to(x(1) >= 1.0);
         problem.subject_to(x(1) <= 10.0);
         problem.subject_to(x(2) >= -10.0);
         problem.subject_to(x(2) <= 1.0);
       }});
  list.push_back(
      {32, vector({0.1, 0.7, 0.2}), 1.0, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(pow(x(0) + 3.0 * x(1) + x(2), 2.0) + 4.0 * pow(x(0) - x(1), 2.0));
         problem.subject_to(1.0 - x(0) - x(1) - x(2) == 0.0);
         problem.subject_to(6.0 * x(1) + 4.0 * x(2) - pow(x(0), 3.0) - 3.0 >= 0.0);
         problem.subject_to(x(0) >= 0.0);
         problem.subject_to(x(1) >= 0.0);
         problem.subject_to(x(2) >= 0.0);
       }});
  list.push_back({33, vector({0.0, 0.0, 3.0}), std::sqrt(2.0) - 6.0,
                  [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize((x(0) - 1) * (x(0) - 2) * (x(0) - 3) + x(2));
                    problem.subject_to(pow(x(2), 2.0) - pow(x(1), 2.0) - pow(x(0), 2.0) >= 0.0);
                    problem.subject_to(pow(x(0), 2.0) + pow(x(1), 2.0) + pow(x(2), 2.0) - 4.0 >=
                                       0.0);
                    problem.subject_to(x(0) >= 0.0);
                    problem.subject_to(x(1) >= 0.0);
                    problem.subject_to(x(2) >= 0.0);
                    problem.subject_to(x(2) <= 5.0);
                  }});
  list.push_back({34, vector({0.0, 1.05, 2.9}), -std::log(std::log(10.0)),
                  [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(-x(0));
                    problem.subject_to(x(1) - exp(x(0)) >= 0.0);
                    problem.subject_to(x(2) - exp(x(1)) >= 0.0);
                    problem.subject_to(x(0) >= 0.0);
                    problem.subject_to(x(0) <= 100.0);
                    problem.subject_to(x(1) >= 0.0);
                    problem.subject_to(x(1) <= 100.0);
                    problem.subject_to(x(2) >= 0.0);
                    problem.subject_to(x(2) <= 10.0);
                  }});
  list.push_back(
      {35, vector({0.5, 0.5, 0.5}), 1.0 / 9.0, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(9.0 - 8.0 * x(0) - 6.0 * x(1) - 4.0 * x(2) + 2.0 * pow(x(0), 2.0) +
                          2.0 * pow(x(1), 2.0) + pow(x(2), 2.0) + 2.0 * x(0) * x(1) +
                          2.0 * x(0) * x(2));
         problem.subject_to(3.0 - x(0) - x(1) - 2.0 * x(2) >= 0.0);
         problem.subject_to(x(0) >= 0.0);
         problem.subject_to(x(1) >= 0.0);
         problem.subject_to(x(2) >= 0.0);
       }});
  list.push_back(
      {36, vector({10.0, 10.0, 10.0}), -3300.0, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(-x(0) * x(1) * x(2));
         problem.subject_to(72.0 - x(0) - 2.0 * x(1) - 2.0 * x(2) >= 0.0);
         problem.subject_to(x(0) >= 0.0);
         problem.subject_to(x(0) <= 20.0);
         problem.subject_to(x(1) >= 0.0);
         problem.subject_to(x(1) <= 11.0);
         problem.subject_to(x(2) >= 0.0);
         problem.subject_to(x(2) <= 42.0);
       }});
  list.push_back(
      {37, vector({10.0, 10.0, 10.0}), -3456.0, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(-x(0) * x(1) * x(2));
         problem.subject_to(72.0 - x(0) - 2.0 * x(1) - 2.0 * x(2) >= 0.0);
         problem.subject_to(x(0) + 2.0 * x(1) + 2.0 * x(2) >= 0.0);
         problem.subject_to(x(0) >= 0.0);
         problem.subject_to(x(0) <= 42.0);
         problem.subject_to(x(1) >= 0.0);
         problem.subject_to(x(1) <= 42.0);
         problem.subject_to(x(2) >= 0.0);
         problem.subject_to(x(2) <= 42.0);
       }});
  list.push_back(
      {38, vector({-3.0, -1.0, -3.0, -1.0}), 0.0, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(100.0 * pow(x(1) - pow(x(0), 2.0), 2.0) + pow(1.0 - x(0), 2.0) +
                          90.0 * pow(x(3) - pow(x(2), 2.0), 2.0) + pow(1.0 - x(2), 2.0) +
                          10.1 * (pow(x(1) - 1.0, 2.0) + pow(x(3) - 1.0, 2.0)) +
                          19.8 * (x(1) - 1) * (x(3) - 1));
         problem.subject_to(x(0) >= -10.0);
         problem.subject_to(x(0) <= 10.0);
         problem.subject_to(x(1) >= -10.0);
         problem.subject_to(x(1) <= 10.0);
         problem.subject_to(x(2) >= -10.0);
         problem.subject_to(x(2) <= 10.0);
         problem.subject_to(x(3) >= -10.0);
         problem.subject_to(x(3) <= 10.0);
       }});
  list.push_back(
      {39, vector({2.0, 2.0, 2.0, 2.0}), -1.0, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(-x(0));
         problem.subject_to(x(1) - pow(x(0), 3.0) - pow(x(2), 2.0) == 0.0);
         problem.subject_to(pow(x(0), 2.0) - x(1) - pow(x(3), 2.0) == 0.0);
       }});
  list.push_back(
      {40, vector({0.8, 0.8, 0.8, 0.8}), -0.25, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(-x(0) * x(1) * x(2) * x(3));
         problem.subject_to(pow(x(0), 3.0) + pow(x(1), 2.0) - 1.0 == 0.0);
         problem.subject_to(pow(x(0), 2.0) * x(3) - x(2) == 0.0);
         problem.subject_to(pow(x(3), 2.0) - x(1) == 0.0);
       }});
  list.push_back({41, vector({2.0, 2.0, 2.0, 2.0}), 52.0 / 27.0,
                  [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(2.0 - x(0) * x(1) * x(2));
                    problem.subject_to(x(0) + 2.0 * x(1) + 2.0 * x(2) - x(3) == 0.0);
                    problem.subject_to(x(0) >= 0.0);
                    problem.subject_to(x(0) <= 1.0);
                    problem.subject_to(x(1) >= 0.0);
                    problem.subject_to(x(1) <= 1.0);
                    problem.subject_to(x(2) >= 0.0);
                    problem.subject_to(x(2) <= 1.0);
                    problem.subject_to(x(3) >= 0.0);
                    problem.subject_to(x(3) <= 2.0);
                  }});
  list.push_back({42, vector({1.0, 1.0, 1.0, 1.0}), 28.0 - 10.0 * std::sqrt(2.0),
                  [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(pow(x(0) - 1.0, 2.0) + pow(x(1) - 2.0, 2.0) +
                                     pow(x(2) - 3.0, 2.0) + pow(x(3) - 4.0, 2.0));
                    problem.subject_to(x(0) - 2.0 == 0.0);
                    problem.subject_to(pow(x(2), 2.0) + pow(x(3), 2.0) - 2.0 == 0.0);
                  }});
  list.push_back(
      {43, vector({0.0, 0.0, 0.0, 0.0}), -44.0, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(pow(x(0), 2.0) + pow(x(1), 2.0) + 2.0 * pow(x(2), 2.0) + pow(x(3), 2.0) -
                          5.0 * x(0) - 5.0 * x(1) - 21.0 * x(2) + 7.0 * x(3));
         problem.subject_to(8.0 - pow(x(0), 2.0) - pow(x(1), 2.0) - pow(x(2), 2.0) -
                                pow(x(3), 2.0) - x(0) + x(1) - x(2) + x(3) >=
                            0.0);
         problem.subject_to(10.0 - pow(x(0), 2.0) - 2.0 * pow(x(1), 2.0) - pow(x(2), 2.0) -
                                2.0 * pow(x(3), 2.0) + x(0) + x(3) >=
                            0.0);
         problem.subject_to(5.0 - 2.0 * pow(x(0), 2.0) - pow(x(1), 2.0) - pow(x(2), 2.0) -
                                2.0 * x(0) + x(1) + x(3) >=
                            0.0);
       }});
  list.push_back({44, vector({0.0, 0.0, 0.0, 0.0}), -15.0,
                  [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(x(0) - x(1) - x(2) - x(0) * x(2) + x(0) * x(3) + x(1) * x(2) -
                                     x(1) * x(3));
                    problem.subject_to(8.0 - x(0) - 2.0 * x(1) >= 0.0);
                    problem.subject_to(12.0 - 4.0 * x(0) - x(1) >= 0.0);
                    problem.subject_to(12.0 - 3.0 * x(0) - 4.0 * x(1) >= 0.0);
                    problem.subject_to(8.0 - 2.0 * x(2) - x(3) >= 0.0);
                    problem.subject_to(8.0 - x(2) - 2.0 * x(3) >= 0.0);
                    problem.subject_to(5.0 - x(2) - x(3) >= 0.0);
                    problem.subject_to(x(0) >= 0.0);
                    problem.subject_to(x(1) >= 0.0);
                    problem.subject_to(x(2) >= 0.0);
                    problem.subject_to(x(3) >= 0.0);
                  },
                  -13.0});
  list.push_back(
      {45, vector({2.0, 2.0, 2.0, 2.0, 2.0}), 1.0, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(2.0 - x(0) * x(1) * x(2) * x(3) * x(4) / 120.0);
         problem.subject_to(x(0) >= 0.0);
         problem.subject_to(x(1) >= 0.0);
         problem.subject_to(x(2) >= 0.0);
         problem.subject_to(x(3) >= 0.0);
         problem.subject_to(x(4) >= 0.0);
         problem.subject_to(x(0) <= 1.0);
         problem.subject_to(x(1) <= 2.0);
         problem.subject_to(x(2) <= 3.0);
         problem.subject_to(x(3) <= 4.0);
         problem.subject_to(x(4) <= 5.0);
       }});
  list.push_back({48, vector({3.0, 5.0, -3.0, 2.0, -2.0}), 0.0,
                  [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(pow(x(0) - 1.0, 2.0) + pow(x(1) - x(2), 2.0) +
                                     pow(x(3) - x(4), 2.0));
                    problem.subject_to(x(0) + x(1) + x(2) + x(3) + x(4) - 5.0 == 0.0);
                    problem.subject_to(x(2) - 2.0 * (x(3) + x(4)) + 3.0 == 0.0);
                  }});
  list.push_back({51, vector({2.5, 0.5, 2.0, -1.0, 0.5}), 0.0,
                  [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(pow(x(0) - x(1), 2.0) + pow(x(1) + x(2) - 2.0, 2.0) +
                                     pow(x(3) - 1.0, 2.0) + pow(x(4) - 1.0, 2.0));
                    problem.subject_to(x(0) + 3.0 * x(1) - 4.0 == 0.0);
                    problem.subject_to(x(2) + x(3) - 2.0 * x(4) == 0.0);
                    problem.subject_to(x(1) - x(4) == 0.0);
                  }});
  list.push_back({52, vector({2.0, 2.0, 2.0, 2.0, 2.0}), 1859.0 / 349.0,
                  [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(pow(4.0 * x(0) - x(1), 2.0) + pow(x(1) + x(2) - 2.0, 2.0) +
                                     pow(x(3) - 1.0, 2.0) + pow(x(4) - 1.0, 2.0));
                    problem.subject_to(x(0) + 3.0 * x(1) == 0.0);
                    problem.subject_to(x(2) + x(3) - 2.0 * x(4) == 0.0);
                    problem.subject_to(x(1) - x(4) == 0.0);
                  }});
  list.push_back({53, vector({2.0, 2.0, 2.0, 2.0, 2.0}), 176.0 / 43.0,
                  [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(pow(x(0) - x(1), 2.0) + pow(x(1) + x(2) - 2.0, 2.0) +
                                     pow(x(3) - 1.0, 2.0) + pow(x(4) - 1.0, 2.0));
                    problem.subject_to(x(0) + 3.0 * x(1) == 0.0);
                    problem.subject_to(x(2) + x(3) - 2.0 * x(4) == 0.0);
                    problem.subject_to(x(1) - x(4) == 0.0);
                    problem.subject_to(x(0) >= -10.0);
                    problem.subject_to(x(0) <= 10.0);
                    problem.subject_to(x(1) >= -10.0);
                    problem.subject_to(x(1) <= 10.0);
                    problem.subject_to(x(2) >= -10.0);
                    problem.subject_to(x(2) <= 10.0);
                    problem.subject_to(x(3) >= -10.0);
                    problem.subject_to(x(3) <= 10.0);
                    problem.subject_to(x(4) >= -10.0);
                    problem.subject_to(x(4) <= 10.0);
                  }});
  list.push_back(
      {60, vector({2.0, 2.0, 2.0}), 0.03256820025, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(pow(x(0) - 1.0, 2.0) + pow(x(0) - x(1), 2.0) + pow(x(1) - x(2), 4.0));
         problem.subject_to(
             x(0) * (1.0 + pow(x(1), 2.0)) + pow(x(2), 4.0) - 4.0 - 3.0 * std::sqrt(2.0) == 0.0);
         problem.subject_to(x(0) >= -10.0);
         problem.subject_to(x(0) <= 10.0);
         problem.subject_to(x(1) >= -10.0);
         problem.subject_to(x(1) <= 10.0);
         problem.subject_to(x(2) >= -10.0);
         problem.subject_to(x(2) <= 10.0);
       }});
  list.push_back(
      {61, vector({0.0, 0.0, 0.0}), -143.6461422, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(4.0 * pow(x(0), 2.0) + 2.0 * pow(x(1), 2.0) + 2.0 * pow(x(2), 2.0) -
                          33.0 * x(0) + 16.0 * x(1) - 24.0 * x(2));
         problem.subject_to(3.0 * x(0) - 2.0 * pow(x(1), 2.0) - 7.0 == 0.0);
         problem.subject_to(4.0 * x(0) - pow(x(2), 2.0) - 11.0 == 0.0);
       }});
  list.push_back(
      {63, vector({2.0, 2.0, 2.0}), 961.7151721, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(1000.0 - pow(x(0), 2.0) - 2.0 * pow(x(1), 2.0) - pow(x(2), 2.0) -
                          x(0) * x(1) - x(0) * x(2));
         problem.subject_to(8.0 * x(0) + 14.0 * x(1) + 7.0 * x(2) - 56.0 == 0.0);
         problem.subject_to(pow(x(0), 2.0) + pow(x(1), 2.0) + pow(x(2), 2.0) - 25.0 == 0.0);
         problem.subject_to(x(0) >= 0.0);
         problem.subject_to(x(1) >= 0.0);
         problem.subject_to(x(2) >= 0.0);
       }});
  list.push_back(
      {65, vector({-5.0, 5.0, 0.0}), 0.9535288567, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(pow(x(0) - x(1), 2.0) + pow((x(0) + x(1) - 10) / 3.0, 2.0) +
                          pow(x(2) - 5.0, 2.0));
         problem.subject_to(48.0 - pow(x(0), 2.0) - pow(x(1), 2.0) - pow(x(2), 2.0) >= 0.0);
         problem.subject_to(x(0) >= -4.5);
         problem.subject_to(x(0) <= 4.5);
         problem.subject_to(x(1) >= -4.5);
         problem.subject_to(x(1) <= 4.5);
         problem.subject_to(x(2) >= -5.0);
         problem.subject_to(x(2) <= 5.0);
       }});
  list.push_back(
      {66, vector({0.0, 1.05, 2.9}), 0.5181632741, [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(0.2 * x(2) - 0.8 * x(0));
         problem.subject_to(x(1) - exp(x(0)) >= 0.0);
         problem.subject_to(x(2) - exp(x(1)) >= 0.0);
         problem.subject_to(x(0) >= 0.0);
         problem.subject_to(x(0) <= 100.0);
         problem.subject_to(x(1) >= 0.0);
         problem.subject_to(x(1) <= 100.0);
         problem.subject_to(x(2) >= 0.0);
         problem.subject_to(x(2) <= 10.0);
       }});
  list.push_back({71, vector({1.0, 5.0, 5.0, 1.0}), 17.0140173,
                  [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(x(0) * x(3) * (x(0) + x(1) + x(2)) + x(2));
                    problem.subject_to(pow(x(0), 2.0) + pow(x(1), 2.0) + pow(x(2), 2.0) +
                                           pow(x(3), 2.0) - 40.0 ==
                                       0.0);
                    problem.subject_to(x(0) * x(1) * x(2) * x(3) - 25.0 >= 0.0);
                    problem.subject_to(x(0) >= 1.0);
                    problem.subject_to(x(0) <= 5.0);
                    problem.subject_to(x(1) >= 1.0);
                    problem.subject_to(x(1) <= 5.0);
                    problem.subject_to(x(2) >= 1.0);
                    problem.subject_to(x(2) <= 5.0);
                    problem.subject_to(x(3) >= 1.0);
                    problem.subject_to(x(3) <= 5.0);
                  }});
  list.push_back({76, vector({0.5, 0.5, 0.5, 0.5}), -4.681818181,
                  [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(pow(x(0), 2.0) + 0.5 * pow(x(1), 2.0) + pow(x(2), 2.0) +
                                     0.5 * pow(x(3), 2.0) - x(0) * x(2) + x(2) * x(3) - x(0) -
                                     3.0 * x(1) + x(2) - x(3));
                    problem.subject_to(5.0 - x(0) - 2.0 * x(1) - x(2) - x(3) >= 0.0);
                    problem.subject_to(4.0 - 3.0 * x(0) - x(1) - 2.0 * x(2) + x(3) >= 0.0);
                    problem.subject_to(x(1) + 4.0 * x(2) - 1.5 >= 0.0);
                    problem.subject_to(x(0) >= 0.0);
                    problem.subject_to(x(1) >= 0.0);
                    problem.subject_to(x(2) >= 0.0);
                    problem.subject_to(x(3) >= 0.0);
                  }});
  list.push_back(
      {77, vector({2.0, 2.0, 2.0, 2.0, 2.0}), 0.24150513,
       [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(pow(x(0) - 1.0, 2.0) + pow(x(0) - x(1), 2.0) + pow(x(2) - 1.0, 2.0) +
                          pow(x(3) - 1.0, 4.0) + pow(x(4) - 1.0, 6.0));
         problem.subject_to(pow(x(0), 2.0) * x(3) + sin(x(3) - x(4)) - 2.0 * std::sqrt(2.0) == 0.0);
         problem.subject_to(x(1) + pow(x(2), 4.0) * pow(x(3), 2.0) - 8.0 - std::sqrt(2.0) == 0.0);
       }});
  list.push_back({78, vector({-2.0, 1.5, 2.0, -1.0, -1.0}), -2.91970041,
                  [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(x(0) * x(1) * x(2) * x(3) * x(4));
                    problem.subject_to(pow(x(0), 2.0) + pow(x(1), 2.0) + pow(x(2), 2.0) +
                                           pow(x(3), 2.0) + pow(x(4), 2.0) - 10.0 ==
                                       0.0);
                    problem.subject_to(x(1) * x(2) - 5.0 * x(3) * x(4) == 0.0);
                    problem.subject_to(pow(x(0), 3.0) + pow(x(1), 3.0) + 1.0 == 0.0);
                  }});
  list.push_back(
      {79, vector({2.0, 2.0, 2.0, 2.0, 2.0}), 0.0787768209,
       [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(pow(x(0) - 1.0, 2.0) + pow(x(0) - x(1), 2.0) + pow(x(1) - x(2), 2.0) +
                          pow(x(2) - x(3), 4.0) + pow(x(3) - x(4), 4.0));
         problem.subject_to(x(0) + pow(x(1), 2.0) + pow(x(2), 3.0) - 2.0 - 3.0 * std::sqrt(2.0) ==
                            0.0);
         problem.subject_to(x(1) - pow(x(2), 2.0) + x(3) + 2.0 - 2.0 * std::sqrt(2.0) == 0.0);
         problem.subject_to(x(0) * x(4) - 2.0 == 0.0);
       }});
  list.push_back({80, vector({-2.0, 2.0, 2.0, -1.0, -1.0}), 0.0539498478,
                  [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(exp(x(0) * x(1) * x(2) * x(3) * x(4)));
                    problem.subject_to(pow(x(0), 2.0) + pow(x(1), 2.0) + pow(x(2), 2.0) +
                                           pow(x(3), 2.0) + pow(x(4), 2.0) - 10.0 ==
                                       0.0);
                    problem.subject_to(x(1) * x(2) - 5.0 * x(3) * x(4) == 0.0);
                    problem.subject_to(pow(x(0), 3.0) + pow(x(1), 3.0) + 1.0 == 0.0);
                    problem.subject_to(x(0) >= -2.3);
                    problem.subject_to(x(0) <= 2.3);
                    problem.subject_to(x(1) >= -2.3);
                    problem.subject_to(x(1) <= 2.3);
                    problem.subject_to(x(2) >= -3.2);
                    problem.subject_to(x(2) <= 3.2);
                    problem.subject_to(x(3) >= -3.2);
                    problem.subject_to(x(3) <= 3.2);
                    problem.subject_to(x(4) >= -3.2);
                    problem.subject_to(x(4) <= 3.2);
                  }});
  list.push_back({81, vector({-2.0, 2.0, 2.0, -1.0, -1.0}), 0.0539498478,
                  [](Problem& problem, const ExpressionMatrix& x) {
                    problem.minimize(exp(x(0) * x(1) * x(2) * x(3) * x(4)) -
                                     0.5 * pow(pow(x(0), 3.0) + pow(x(1), 3.0) + 1.0, 2.0));
                    problem.subject_to(pow(x(0), 2.0) + pow(x(1), 2.0) + pow(x(2), 2.0) +
                                           pow(x(3), 2.0) + pow(x(4), 2.0) - 10.0 ==
                                       0.0);
                    problem.subject_to(x(1) * x(2) - 5.0 * x(3) * x(4) == 0.0);
                    problem.subject_to(pow(x(0), 3.0) + pow(x(1), 3.0) + 1.0 == 0.0);
                    problem.subject_to(x(0) >= -2.3);
                    problem.subject_to(x(0) <= 2.3);
                    problem.subject_to(x(1) >= -2.3);
                    problem.subject_to(x(1) <= 2.3);
                    problem.subject_to(x(2) >= -3.2);
                    problem.subject_to(x(2) <= 3.2);
                    problem.subject_to(x(3) >= -3.2);
                    problem.subject_to(x(3) <= 3.2);
                    problem.subject_to(x(4) >= -3.2);
                    problem.subject_to(x(4) <= 3.2);
                  }});
  list.push_back(
      {100, vector({1.0, 2.0, 0.0, 4.0, 0.0, 1.0, 1.0}), 680.6300573,
       [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(pow(x(0) - 10.0, 2.0) + 5.0 * pow(x(1) - 12.0, 2.0) + pow(x(2), 4.0) +
                          3.0 * pow(x(3) - 11.0, 2.0) + 10.0 * pow(x(4), 6.0) +
                          7.0 * pow(x(5), 2.0) + pow(x(6), 4.0) - 4.0 * x(5) * x(6) - 10.0 * x(5) -
                          8.0 * x(6));
         problem.subject_to(127.0 - 2.0 * pow(x(0), 2.0) - 3.0 * pow(x(1), 4.0) - x(2) -
                                4.0 * pow(x(3), 2.0) - 5.0 * x(4) >=
                            0.0);
         problem.subject_to(282.0 - 7.0 * x(0) - 3.0 * x(1) - 10.0 * pow(x(2), 2.0) - x(3) + x(4) >=
                            0.0);
         problem.subject_to(
             196.0 - 23.0 * x(0) - pow(x(1), 2.0) - 6.0 * pow(x(5), 2.0) + 8.0 * x(6) >= 0.0);
         problem.subject_to(-4.0 * pow(x(0), 2.0) - pow(x(1), 2.0) + 3.0 * x(0) * x(1) -
                                2.0 * pow(x(2), 2.0) - 5.0 * x(5) + 11.0 * x(6) >=
                            0.0);
       }});
  list.push_back(
      {113, vector({2.0, 3.0, 5.0, 5.0, 1.0, 2.0, 7.0, 3.0, 6.0, 10.0}), 24.3062091,
       [](Problem& problem, const ExpressionMatrix& x) {
         problem.minimize(pow(x(0), 2.0) + pow(x(1), 2.0) + x(0) * x(1) - 14.0 * x(0) -
                          16.0 * x(1) + pow(x(2) - 10.0, 2.0) + 4.0 * pow(x(3) - 5.0, 2.0) +
                          pow(x(4) - 3.0, 2.0) + 2.0 * pow(x(5) - 1.0, 2.0) + 5.0 * pow(x(6), 2.0) +
                          7.0 * pow(x(7) - 11.0, 2.0) + 2.0 * pow(x(8) - 10.0, 2.0) +
                          pow(x(9) - 7.0, 2.0) + 45.0);
         problem.subject_to(105.0 - 4.0 * x(0) - 5.0 * x(1) + 3.0 * x(6) - 9.0 * x(7) >= 0.0);
         problem.subject_to(-10.0 * x(0) + 8.0 * x(1) + 17.0 * x(6) - 2.0 * x(7) >= 0.0);
         problem.subject_to(8.0 * x(0) - 2.0 * x(1) - 5.0 * x(8) + 2.0 * x(9) + 12.0 >= 0.0);
         problem.subject_to(-3.0 * pow(x(0) - 2.0, 2.0) - 4.0 * pow(x(1) - 3.0, 2.0) -
                                2.0 * pow(x(2), 2.0) + 7.0 * x(3) + 120.0 >=
                            0.0);
         problem.subject_to(
             -5.0 * pow(x(0), 2.0) - 8.0 * x(1) - pow(x(2) - 6.0, 2.0) + 2.0 * x(3) + 40.0 >= 0.0);
         problem.subject_to(-0.5 * pow(x(0) - 8.0, 2.0) - 2.0 * pow(x(1) - 4.0, 2.0) -
                                3.0 * pow(x(4), 2.0) + x(5) + 30.0 >=
                            0.0);
         problem.subject_to(-pow(x(0), 2.0) - 2.0 * pow(x(1) - 2.0, 2.0) + 2.0 * x(0) * x(1) -
                                14.0 * x(4) + 6.0 * x(5) >=
                            0.0);
         problem.subject_to(3.0 * x(0) - 6.0 * x(1) - 12.0 * pow(x(8) - 8.0, 2.0) + 7.0 * x(9) >=
                            0.0);
       }});
  return list;
}

TEST(HockSchittkowski, SolvedToThePublishedOptima) {
  int iterations = 0;
  for (const Case& test : cases()) {
    Problem problem;
    ExpressionMatrix x = problem.decision_variable(test.start.size());
    x.set_value(test.start);
    test.state(problem, x);
    const auto solution = problem.solve();
    ASSERT_TRUE(solution) << test.number << ": " << to_string(solution.error());
    EXPECT_TRUE(solution->solved()) << test.number << ": " << solution->message << " after "
                                    << solution->counts.iterations << " iterations";
    const double tolerance = 1e-6 * std::max(1.0, std::abs(test.optimum));
    if (!(std::abs(solution->cost - test.other_optimum) <= tolerance)) {
      EXPECT_NEAR(solution->cost, test.optimum, tolerance) << test.number;
    }
    EXPECT_LE(solution->infeasibility, 1e-7) << test.number;
    iterations += solution->counts.iterations;
  }
  RecordProperty("iterations", iterations);
}

}  // namespace
