#pragma once

#include <string>
#include <string_view>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/solve/solver.hpp>

/// What problems that are written in the test are answered with.
namespace flyball::solve {

using Json = nlohmann::json;

inline Json answer(std::string_view kind, const std::string& problem) {
  return Json::parse(Solver::create(kind).value().solve(problem).json);
}

/// The code of the error, or "" if there was none.
inline std::string refusal(std::string_view kind, const std::string& problem) {
  const Answer solved = Solver::create(kind).value().solve(problem);
  const Json json = Json::parse(solved.json);
  EXPECT_EQ(solved.solved, !json.contains("error")) << solved.json;
  return solved.solved ? "" : json.at("error").at("code").get<std::string>();
}

/// Of a matrix, or a complex number's part.
inline double entry(const Json& json, const char* name, std::size_t i = 0, std::size_t j = 0) {
  return json.at(name).at(i).at(j).get<double>();
}

inline double number(const Json& json, const char* name) {
  return json.at(name).get<double>();
}

/// Every entry of a matrix.
inline void expect_matrix(const Json& json, const char* name, const Json& expected,
                          double tolerance = 1e-14) {
  const Json& M = json.at(name);
  ASSERT_EQ(M.size(), expected.size()) << name << " is " << M;
  for (std::size_t i = 0; i < M.size(); ++i) {
    ASSERT_EQ(M[i].size(), expected[i].size()) << name << " is " << M;
    for (std::size_t j = 0; j < M[i].size(); ++j) {
      EXPECT_NEAR(M[i][j].get<double>(), expected[i][j].get<double>(), tolerance)
          << name << "(" << i << ", " << j << ")";
    }
  }
}

}  // namespace flyball::solve
