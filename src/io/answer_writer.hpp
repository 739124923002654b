#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include <flyball/core/expected.hpp>

namespace flyball {

/// One JSON object, written from left to right.
class AnswerWriter {
 public:
  void begin(const nlohmann::json* id);
  void add(std::string_view name, const Eigen::MatrixXd& M);
  void add(std::string_view name, const Eigen::VectorXcd& values);
  void add_list(std::string_view name, const Eigen::VectorXd& values);
  void add_list(std::string_view name, const std::vector<Eigen::MatrixXd>& matrices);
  void add(std::string_view name, double value);
  void add(std::string_view name, bool value);
  void add_text(std::string_view name, std::string_view text);
  /// @param json  A value, as it shall stand there.
  void add_json(std::string_view name, const std::string& json);
  void add(const Error& error);
  [[nodiscard]] std::string end();

 private:
  void key(std::string_view name);
  void number(double value);
  void matrix(const Eigen::MatrixXd& M);

  std::string text_;
  bool empty_ = true;
};

}  // namespace flyball
