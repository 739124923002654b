# install() and export(): find_package(flyball) gives flyball::flyball and one target a domain.
get_property(domains GLOBAL PROPERTY FLYBALL_DOMAINS)
set(targets flyball)
foreach(domain IN LISTS domains)
  list(APPEND targets flyball_${domain})
endforeach()

install(
  TARGETS ${targets}
  EXPORT flyballTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
  RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(
  DIRECTORY ${PROJECT_SOURCE_DIR}/include/flyball ${PROJECT_BINARY_DIR}/include/flyball
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  FILES_MATCHING
  PATTERN "*.hpp"
  PATTERN "*.inc"
  PATTERN "*.tpp")
if(TARGET flyball_command)
  install(TARGETS flyball_command RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()

set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/flyball)
install(
  EXPORT flyballTargets
  NAMESPACE flyball::
  DESTINATION ${config_dir})
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/flyballConfig.cmake.in
                              ${PROJECT_BINARY_DIR}/flyballConfig.cmake
                              INSTALL_DESTINATION ${config_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/flyballConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/flyballConfig.cmake
              ${PROJECT_BINARY_DIR}/flyballConfigVersion.cmake DESTINATION ${config_dir})
