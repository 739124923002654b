#pragma once

#include <fstream>
#include <string>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

namespace flyball::test {

/// A row-major nested list as a matrix.
inline Eigen::MatrixXd matrix_from(const nlohmann::json& rows) {
  Eigen::MatrixXd M(static_cast<Eigen::Index>(rows.size()),
                    static_cast<Eigen::Index>(rows.at(0).size()));
  for (Eigen::Index i = 0; i < M.rows(); ++i) {
    for (Eigen::Index j = 0; j < M.cols(); ++j) {
      M(i, j) = rows.at(static_cast<std::size_t>(i)).at(static_cast<std::size_t>(j)).get<double>();
    }
  }
  return M;
}

/// The cases of a file of tests/data.
inline nlohmann::json cases_of(const std::string& file) {
  std::string path = FLYBALL_PROJECT_DATA "/";
  path += file;
  std::ifstream stream(path);
  return nlohmann::json::parse(stream).at("cases");
}

}  // namespace flyball::test
