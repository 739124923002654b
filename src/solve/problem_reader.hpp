#pragma once

#include <complex>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include <flyball/core/expected.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/systems/analysis.hpp>

namespace flyball::solve {

/// The JSON object that a text is.
/// @param where  The kind of problem or the file, for messages. @param what  "problem" or "model".
/// @errors ArgumentError::malformed: no JSON, with the place; no object; nesting that no problem
/// has.
[[nodiscard]] Expected<nlohmann::json> parse_object(std::string_view text, std::string_view where,
                                                    std::string_view what);

/// Every field known, every necessary one there.
/// @param required  Names separated by spaces, as `optional`; `id` is always known.
/// @errors ArgumentError::unknown_name with the nearest name, malformed for a field left out.
[[nodiscard]] Expected<void> check_fields(const nlohmann::json& object, std::string_view where,
                                          std::string_view required, std::string_view optional);

/// The fields of one object, read with errors that name the field. The first error stays; what is
/// read after it is empty.
class ProblemReader {
 public:
  /// @param where  The kind of problem or the file, for messages.
  ProblemReader(const nlohmann::json& object, std::string_view where)
      : object_(object), where_(where) {}

  [[nodiscard]] Eigen::MatrixXd matrix(const char* name);
  /// The matrix, or zeros where the field is absent or null.
  [[nodiscard]] Eigen::MatrixXd matrix_or_zero(const char* name, Eigen::Index rows,
                                               Eigen::Index columns);
  /// The matrix, or the identity.
  [[nodiscard]] Eigen::MatrixXd matrix_or_identity(const char* name, Eigen::Index size);
  /// A matrix; a list of numbers is its only column.
  [[nodiscard]] Eigen::MatrixXd columns(const char* name);
  [[nodiscard]] bool has(const char* name) const;
  [[nodiscard]] double number(const char* name);
  [[nodiscard]] std::string text(const char* name);
  /// A list of texts, or nothing where the field is absent.
  [[nodiscard]] std::vector<std::string> names(const char* name);
  /// "continuous" or "discrete". @errors ArgumentError::unknown_name, in `status`.
  [[nodiscard]] TimeDomain domain(const char* name = "domain");
  /// A, B and, where they are left out, C = I and D = 0.
  [[nodiscard]] ContinuousSystem<> system();
  [[nodiscard]] Eigen::VectorXcd complex_list(const char* name);

  [[nodiscard]] const Expected<void>& status() const { return status_; }

 private:
  void fail(const char* name, std::string got, std::string expected);
  bool read(const nlohmann::json& value, double& number);

  const nlohmann::json& object_;
  std::string_view where_;
  Expected<void> status_;
};

}  // namespace flyball::solve
