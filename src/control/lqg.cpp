#include <flyball/control/lqg.tpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace detail {

Expected<void> check_lqg(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C,
                         const MatrixRef& D, Time period, const MatrixRef& K, const MatrixRef& K_e,
                         const MatrixRef& u_min, const MatrixRef& u_max) {
  constexpr std::string_view where = "Lqg";
  FLYBALL_CHECK(check_system(A, B, C, D, where));
  const Eigen::Index n = A.rows();
  const Eigen::Index m = B.cols();
  const Eigen::Index p = C.rows();
  FLYBALL_CHECK(Checks(where)
                    .positive(period.si(), "period", "s")
                    .shape(K, m, n, "K", "inputs x states")
                    .shape(K_e, n, p, "K_e", "states x outputs")
                    .shape(u_min, m, 1, "u_min", "inputs x 1")
                    .shape(u_max, m, 1, "u_max", "inputs x 1")
                    .finite(K, "K")
                    .finite(K_e, "K_e"));
  for (Eigen::Index i = 0; i < m; ++i) {
    if (!(u_min(i, 0) < u_max(i, 0))) {
      return refusal(ArgumentError::out_of_range, where, detail::format("u_min({})", i))
          .got(format_number(u_min(i, 0)))
          .expected(detail::format("below u_max({}), which is {}", i, format_number(u_max(i, 0))));
    }
  }
  return {};
}

}  // namespace detail

#define FLYBALL_STATES_INPUTS_OUTPUTS(States, Inputs, Outputs) \
  template class Lqg<States, Inputs, Outputs>;
#include <flyball/core/instantiated_sizes.inc>

}  // namespace flyball
