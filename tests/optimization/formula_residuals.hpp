#pragma once

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <flyball/math/expression/differentiate.hpp>
#include <flyball/math/expression/formula.hpp>
#include <flyball/optimization/least_squares.hpp>

namespace flyball::optimization {

/// Residuals as formulas of parameters, and of columns of data: each formula once a row.
class FormulaBlock final : public ResidualBlock {
 public:
  /// @param data  A column for each of `columns`; without columns one empty row.
  FormulaBlock(const std::vector<std::string>& formulas, const std::vector<std::string>& parameters,
               const std::vector<std::string>& columns, Eigen::MatrixXd data)
      : ResidualBlock(static_cast<Eigen::Index>(formulas.size()) * data.rows(),
                      places(parameters.size())),
        data_(std::move(data)),
        formulas_(formulas.size()) {
    expression::FormulaSet set;
    for (const std::string& name : parameters) {
      set.variables.push_back({name});
    }
    for (const std::string& name : columns) {
      set.variables.push_back({name});
    }
    for (const std::string& text : formulas) {
      set.outputs.push_back({"r", text});
    }
    const auto compiled = expression::compile(set);
    EXPECT_TRUE(compiled) << (compiled ? "" : to_string(compiled.error().front()));
    derivatives_ = expression::differentiate(compiled->tape);
    values_.resize(derivatives_.workspace_size());
    derivatives_.tape.prepare<double>({}, values_);
  }

  [[nodiscard]] bool evaluate(const Eigen::VectorXd& x, Eigen::VectorXd& r,
                              Eigen::MatrixXd* J) const override {
    std::vector<double> values = values_;
    std::vector<double> inputs(static_cast<std::size_t>(x.size() + data_.cols()));
    std::vector<double> y(formulas_);
    const auto count = static_cast<Eigen::Index>(formulas_);
    Eigen::MatrixXd all(count, x.size() + data_.cols());
    for (Eigen::Index row = 0; row < data_.rows(); ++row) {
      std::copy(x.begin(), x.end(), inputs.begin());
      for (Eigen::Index c = 0; c < data_.cols(); ++c) {
        inputs[static_cast<std::size_t>(x.size() + c)] = data_(row, c);
      }
      derivatives_.evaluate(inputs, y, all, values);
      for (Eigen::Index i = 0; i < count; ++i) {
        r(row * count + i) = y[static_cast<std::size_t>(i)];
      }
      if (J != nullptr) {
        J->middleRows(row * count, count) = all.leftCols(x.size());
      }
    }
    return true;
  }

 private:
  static std::vector<Eigen::Index> places(std::size_t count) {
    std::vector<Eigen::Index> all;
    for (std::size_t i = 0; i < count; ++i) {
      all.push_back(static_cast<Eigen::Index>(i));
    }
    return all;
  }

  Eigen::MatrixXd data_;
  std::size_t formulas_;
  expression::Derivatives derivatives_;
  std::vector<double> values_;
};

/// "x1", "x2", …
inline std::vector<std::string> numbered(const std::string& letter, std::size_t count) {
  std::vector<std::string> names;
  for (std::size_t i = 1; i <= count; ++i) {
    names.push_back(letter + std::to_string(i));
  }
  return names;
}

}  // namespace flyball::optimization
