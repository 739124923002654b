#include <flyball/report/terminal.hpp>

#include "report/render_terminal.hpp"
#include "report/sections.hpp"

namespace flyball::report {

std::string to_terminal(const study::IdentifyResult& result, const TerminalStyle& style,
                        std::string_view report_folder) {
  return render_terminal(document_of(result), style, report_folder);
}

std::string to_terminal(const study::DesignResult& result, const TerminalStyle& style,
                        std::string_view report_folder) {
  return render_terminal(document_of(result), style, report_folder);
}

std::string to_terminal(const study::TuneResult& result, const TerminalStyle& style,
                        std::string_view report_folder) {
  return render_terminal(document_of(result), style, report_folder);
}

std::string to_terminal(const study::ModelAnalysis& result, const TerminalStyle& style,
                        std::string_view report_folder) {
  return render_terminal(document_of(result), style, report_folder);
}

}  // namespace flyball::report
