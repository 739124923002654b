#pragma once

#include <string>

#include <flyball/classical/transfer_function.hpp>

#include "math/matrices_json.hpp"

/// Transfer functions of tests/data, and random ones.
namespace flyball::test {

inline Eigen::VectorXd vector_of(const nlohmann::json& list) {
  Eigen::VectorXd v(static_cast<Eigen::Index>(list.size()));
  for (Eigen::Index i = 0; i < v.size(); ++i) {
    v(i) = list[static_cast<std::size_t>(i)].get<double>();
  }
  return v;
}

inline classical::TransferFunction transfer_of(const nlohmann::json& c) {
  const double dt = c.value("dt", 0.0);
  return classical::TransferFunction::create(vector_of(c["num"]), vector_of(c["den"]),
                                             dt > 0.0 ? std::optional(Time(dt)) : std::nullopt)
      .value();
}

inline classical::TransferFunction transfer(std::initializer_list<double> num,
                                            std::initializer_list<double> den, double delay = 0.0) {
  const auto list = [](std::initializer_list<double> values) {
    return Eigen::Map<const Eigen::VectorXd>(values.begin(),
                                             static_cast<Eigen::Index>(values.size()));
  };
  return classical::TransferFunction::create(list(num), list(den), std::nullopt, Time(delay))
      .value();
}

}  // namespace flyball::test
