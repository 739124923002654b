#include <cstdio>

#include <flyball/core/argument.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/core/random.hpp>
#include <flyball/core/version.hpp>

using namespace flyball::literals;

int main() {
  const auto mass = flyball::parse_quantity<flyball::Mass>("8 kg", "mass");
  const auto refused = flyball::parse_quantity<flyball::Mass>("8 m", "mass");
  const auto shape = flyball::check_shape(Eigen::MatrixXd::Identity(2, 2), 1, 1, "lqr", "R");
  if (!mass || *mass != 8_kg || refused || shape || flyball::version.empty()) {
    return 1;
  }
  std::puts(to_string(refused.error()).c_str());
  return 0;
}
