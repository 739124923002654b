#include <flyball/classical/block_diagram.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "classical/transfer_cases.hpp"
#include "support/random_systems.hpp"

namespace flyball::classical::block_diagram_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using flyball::test::transfer;

/// A transfer function of order 0 to 2 with a dead time or without.
TransferFunction random_transfer(Random& random) {
  const auto n = static_cast<Index>(random.bits() % 3);
  VectorXd num(n + 1);
  VectorXd den(n + 1);
  for (Index i = 0; i <= n; ++i) {
    num(i) = random.normal();
    den(i) = random.normal();
  }
  den(0) = 1.0 + random.uniform();
  const double delay = random.bits() % 2 == 0 ? 0.0 : random.uniform();
  return TransferFunction::create(num, den, std::nullopt, Time(delay)).value();
}

DelaySystem system_of(const TransferFunction& G) {
  return DelaySystem::create(G).value();
}

Block block(const char* name, const TransferFunction& G, const char* in, const char* out) {
  return {name, system_of(G), {in}, {out}};
}

// Appendix A, both sides of each rule as diagrams, equal at every frequency; P₁, P₂ of any order
// and dead time, both signs.
TEST(BlockDiagram, AppendixA) {
  Random random(21);
  double worst = 0.0;
  for (int trial = 0; trial < 2000; ++trial) {
    const TransferFunction P1 = random_transfer(random);
    const TransferFunction P2 = random_transfer(random);
    const bool plus = random.bits() % 2 == 0;
    const std::string sign = plus ? "" : "-";
    const std::string opposite = plus ? "-" : "";
    const auto made = [](const BlockDiagram& diagram) { return connect(diagram).value().system; };
    const auto inverse_exists = P2.relative_degree() == 0 && !P2.is_zero();

    // A.1
    const auto cascade =
        made({{block("P1", P1, "x", "m"), block("P2", P2, "m", "y")}, {}, {"x"}, {"y"}});
    // A.2 and its other form, A.3: Y = P₁X ± P₂X = (P₁/P₂ ± 1) P₂X.
    const auto parallel_blocks = made({{block("P1", P1, "x", "a"), block("P2", P2, "x", "b")},
                                       {{"y", {"a", sign + "b"}}},
                                       {"x"},
                                       {"y"}});
    // A.4: Y = P₁(X ∓ P₂Y).
    const auto loop = made({{block("P1", P1, "e", "y"), block("P2", P2, "y", "f")},
                            {{"e", {"x", opposite + "f"}}},
                            {"x"},
                            {"y"}});
    for (const double w : {0.0, 0.02, 0.6, 3.0, 50.0}) {
      const Complex p1 = P1.response(w);
      const Complex p2 = P2.response(w);
      const double s = plus ? 1.0 : -1.0;
      const auto check = [&](Complex got, Complex expected, double size) {
        worst = std::max(worst, std::abs(got - expected) / size);
      };
      check(cascade.response(w)(0, 0), p1 * p2, std::abs(p1 * p2) * 10.0);
      check(parallel_blocks.response(w)(0, 0), p1 + s * p2, std::abs(p1) + std::abs(p2));
      const Complex y = loop.response(w)(0, 0);
      check(y * (1.0 + s * p1 * p2), p1, std::abs(p1) + std::abs(y) * (1.0 + std::abs(p1 * p2)));
    }
    if (!inverse_exists || P2.delay() > 0.0) {
      continue;
    }
    const auto back = TransferFunction::create(P2.den(), P2.num()).value();
    // A.3: P₂, then P₁/P₂ beside one.
    const auto moved =
        made({{block("P2", P2, "x", "m"), block("1/P2", back, "m", "k"), block("P1", P1, "k", "a")},
              {{"y", {"a", sign + "m"}}},
              {"x"},
              {"y"}});
    // A.5: 1/P₂ in front of the loop of P₁P₂ with one on the way back.
    const auto unity =
        made({{block("1/P2", back, "x", "k"), block("P2", P2, "e", "m"), block("P1", P1, "m", "y")},
              {{"e", {"k", opposite + "y"}}},
              {"x"},
              {"y"}});
    for (const double w : {0.02, 0.6, 3.0}) {
      const Complex a = parallel_blocks.response(w)(0, 0);
      const double size = std::abs(P1.response(w)) + std::abs(P2.response(w));
      worst = std::max(worst, std::abs(moved.response(w)(0, 0) - a) / size * 1e-2);
      const Complex b = loop.response(w)(0, 0);
      worst = std::max(worst, std::abs(unity.response(w)(0, 0) - b) /
                                  (std::abs(b) * (1.0 + std::abs(b * P2.response(w)))) * 1e-2);
    }
  }
  EXPECT_LE(worst, 1e-12);
}

// A plant with two inputs, its disturbance and noise from outside: the gang of four, with dead time
// in the plant.
TEST(BlockDiagram, ManySignals) {
  const TransferFunction P = transfer({2.0}, {1.0, 1.0, 0.0}, 0.1);
  const TransferFunction C = transfer({1.0, 1.0}, {0.1, 1.0});
  const auto made = connect({{block("P", P, "v", "x"), block("C", C, "e", "u")},
                             {{"v", {"u", "d"}}, {"y", {"x", "n"}}, {"e", {"r", "-y"}}},
                             {"r", "d", "n"},
                             {"y", "u", "e", "-x"}})
                        .value();
  EXPECT_TRUE(made.unused.empty());
  EXPECT_EQ(made.system.states(), 3);
  for (const double w : {0.1, 1.0, 7.0}) {
    const Complex p = P.response(w);
    const Complex c = C.response(w);
    const Complex S = 1.0 / (1.0 + p * c);
    MatrixXcd expected(4, 3);
    expected << p * c * S, p * S, S, c * S, -p * c * S, -c * S, S, -p * S, -S, -p * c * S, -p * S,
        p * c * S;
    EXPECT_LE((made.system.response(w) - expected).norm(), 1e-13 * expected.norm()) << w;
  }
}

TEST(BlockDiagram, SignalsMaySkipBlocksAndAddUp) {
  const auto G = transfer({1.0}, {1.0, 1.0});
  const auto made = connect({{block("G", G, "-r", "y"), block("H", G, "y", "spare")},
                             {{"twice", {"y", "y", "-r"}}},
                             {"r"},
                             {"twice", "r"}})
                        .value();
  EXPECT_EQ(made.unused, std::vector<std::string>{"spare"});
  EXPECT_NEAR(made.system.dc_gain()(0, 0), -3.0, 1e-15);
  EXPECT_EQ(made.system.dc_gain()(1, 0), 1.0);
}

TEST(BlockDiagram, Errors) {
  const auto G = transfer({1.0}, {1.0, 1.0});
  const auto gain = transfer({-1.0}, {1.0});
  const auto refused = [](const BlockDiagram& diagram) {
    return to_string(connect(diagram).error());
  };
  EXPECT_EQ(refused({{block("plant", G, "torque", "angle")}, {}, {"torqe"}, {"angle"}}),
            "connect: signal torque of block plant is made by nothing; it must be made by a block "
            "or a junction, or an input of the diagram; did you mean \"torqe\"?");
  EXPECT_EQ(refused({{block("P", G, "u", "y"), block("Q", G, "u", "y")}, {}, {"u"}, {"y"}}),
            "connect: signal y is made by block P and by block Q; it must be made once; rename "
            "one, or add them in a junction");
  EXPECT_EQ(refused({{block("K", gain, "e", "u"), block("P", G, "u", "y")},
                     {{"e", {"r", "-u"}}},
                     {"r"},
                     {"y"}}),
            "connect: the loop of block K and the junction of e is without dynamics and without an "
            "answer; it must be a loop whose gain is not one at infinite frequency; give one of "
            "them dynamics or dead time");
  EXPECT_EQ(refused({{{"P", system_of(G), {"u", "v"}, {"y"}}}, {}, {"u"}, {"y"}}),
            "connect: the number of names for inputs of block P is 2; it must be 1, one for each "
            "input");
  const auto fails = [](const BlockDiagram& diagram, auto code) {
    return connect(diagram).error().is(code);
  };
  const auto sampled =
      TransferFunction::create(VectorXd::Ones(1), VectorXd::Ones(1), Time(0.1)).value();
  EXPECT_TRUE(fails({{block("P", G, "u", "y"), block("Q", sampled, "y", "z")}, {}, {"u"}, {"z"}},
                    TransferError::period_mismatch));
  EXPECT_TRUE(fails({{}, {}, {"u"}, {"u"}}, ArgumentError::empty));
  EXPECT_TRUE(fails({{block("P", G, "u", "y")}, {}, {}, {"y"}}, ArgumentError::empty));
  EXPECT_TRUE(fails({{block("P", G, "u", "y")}, {}, {"u"}, {}}, ArgumentError::empty));
  EXPECT_TRUE(fails({{block("P", G, "u", "")}, {}, {"u"}, {"u"}}, ArgumentError::empty));
  EXPECT_TRUE(fails({{block("P", G, "u", "y")}, {{"e", {}}}, {"u"}, {"y"}}, ArgumentError::empty));
  EXPECT_TRUE(fails({{block("P", G, "u", "y")}, {}, {"u"}, {"x"}}, ArgumentError::unknown_name));
}

}  // namespace
}  // namespace flyball::classical::block_diagram_test
