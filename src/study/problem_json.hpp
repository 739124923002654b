#pragma once

#include <complex>
#include <string>
#include <string_view>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include <flyball/core/expected.hpp>
#include <flyball/core/quantity.hpp>

namespace flyball::study {

/// The fields of one problem, read with errors that name the field. The first error stays; what is
/// read after it is empty.
class ProblemReader {
 public:
  ProblemReader(const nlohmann::json& object, std::string_view kind)
      : object_(object), kind_(kind) {}

  [[nodiscard]] Eigen::MatrixXd matrix(const char* name);
  /// The matrix, or zeros where the field is absent or null.
  [[nodiscard]] Eigen::MatrixXd matrix_or_zero(const char* name, Eigen::Index rows,
                                               Eigen::Index columns);
  /// The matrix, or the identity.
  [[nodiscard]] Eigen::MatrixXd matrix_or_identity(const char* name, Eigen::Index size);
  [[nodiscard]] bool has(const char* name) const;
  [[nodiscard]] double number(const char* name);
  [[nodiscard]] std::string text(const char* name);
  [[nodiscard]] Eigen::VectorXcd complex_list(const char* name);

  [[nodiscard]] const Expected<void>& status() const { return status_; }

 private:
  void fail(const char* name, std::string got, std::string expected);
  bool read(const nlohmann::json& value, double& number);

  const nlohmann::json& object_;
  std::string_view kind_;
  Expected<void> status_;
};

/// One JSON object, written from left to right.
class AnswerWriter {
 public:
  void begin(const nlohmann::json* id);
  void add(std::string_view name, const Eigen::MatrixXd& M);
  void add(std::string_view name, const Eigen::VectorXcd& values);
  void add_list(std::string_view name, const Eigen::VectorXd& values);
  void add(std::string_view name, double value);
  void add(std::string_view name, bool value);
  void add_json(std::string_view name, const std::string& json);
  void add(const Error& error);
  [[nodiscard]] std::string end();

 private:
  void key(std::string_view name);
  void number(double value);

  std::string text_;
  bool empty_ = true;
};

}  // namespace flyball::study
