# What `cmake --install` puts where, and the Debian packages that CPack makes of it
# (scripts/package.sh): gapfarm (the master, data, documents) and gapfarm-worker.
include(GNUInstallDirs)
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)  # installing does not build the tests
set(made ${PROJECT_BINARY_DIR}/install)
set(data ${CMAKE_INSTALL_DATADIR}/gapfarm)

# Made by the programs themselves, so that nothing drifts: manual pages and completions.
add_custom_command(
  OUTPUT ${made}/gapfarm.1 ${made}/gapfarm.bash ${made}/_gapfarm ${made}/gapfarm.fish
  COMMAND ${CMAKE_COMMAND} -E make_directory ${made}
  COMMAND gapfarm --manual > ${made}/gapfarm.1
  COMMAND gapfarm completion bash > ${made}/gapfarm.bash
  COMMAND gapfarm completion zsh > ${made}/_gapfarm
  COMMAND gapfarm completion fish > ${made}/gapfarm.fish
  DEPENDS gapfarm VERBATIM)
add_custom_command(
  OUTPUT ${made}/gapfarm-worker.1
  COMMAND ${CMAKE_COMMAND} -E make_directory ${made}
  COMMAND gapfarm-worker --manual > ${made}/gapfarm-worker.1
  DEPENDS gapfarm-worker VERBATIM)
# Compressed as Debian wants its pages; -n leaves the time out, so that packages can be repeated.
find_program(GZIP_PROGRAM gzip REQUIRED)
foreach(page gapfarm gapfarm-worker)
  add_custom_command(
    OUTPUT ${made}/${page}.1.gz
    COMMAND ${GZIP_PROGRAM} -9 -n -k -f ${made}/${page}.1 DEPENDS ${made}/${page}.1 VERBATIM)
endforeach()
# A build of the programs alone does without; installing makes what is missing.
add_custom_target(install_files DEPENDS
  ${made}/gapfarm.1.gz ${made}/gapfarm-worker.1.gz ${made}/gapfarm.bash ${made}/_gapfarm
  ${made}/gapfarm.fish)
install(CODE "
  execute_process(COMMAND \"${CMAKE_COMMAND}\" --build \"${PROJECT_BINARY_DIR}\" --target install_files
                  RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR \"cannot make what is installed: build the target install_files in \"
                        \"${PROJECT_BINARY_DIR}, as whom it belongs to:\\n\${output}\")
  endif()" ALL_COMPONENTS)

# The units name the folder that they are installed for, which is known when they are.
install(CODE "
  foreach(unit gapfarm-worker gapfarm-run@)
    file(READ ${PROJECT_SOURCE_DIR}/scripts/launch/systemd/\${unit}.service text)
    string(REPLACE /usr/local/bin \${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_BINDIR} text \"\${text}\")
    file(WRITE ${made}/\${unit}.service \"\${text}\")
  endforeach()" ALL_COMPONENTS)
set(units lib/systemd/system)  # where Debian 12 looks, also below a prefix of one's own

install(TARGETS gapfarm RUNTIME COMPONENT gapfarm)
install(TARGETS gapfarm-worker RUNTIME COMPONENT gapfarm-worker)
install(DIRECTORY configs DESTINATION ${data} COMPONENT gapfarm)
# Programs of the build find them, too, from wherever they are called.
file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/share/gapfarm)
file(CREATE_LINK ${PROJECT_SOURCE_DIR}/configs ${CMAKE_BINARY_DIR}/share/gapfarm/configs SYMBOLIC)
install(DIRECTORY scripts/launch DESTINATION ${data} COMPONENT gapfarm USE_SOURCE_PERMISSIONS
        PATTERN systemd EXCLUDE)
install(DIRECTORY scripts/bridges DESTINATION ${data}/scripts COMPONENT gapfarm
        USE_SOURCE_PERMISSIONS)
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT gapfarm)
install(FILES README.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT gapfarm)
install(FILES ${made}/gapfarm.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT gapfarm)
install(FILES ${made}/gapfarm-worker.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1
        COMPONENT gapfarm-worker)
install(FILES ${made}/gapfarm.bash RENAME gapfarm COMPONENT gapfarm
        DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
install(FILES ${made}/_gapfarm COMPONENT gapfarm
        DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions)
install(FILES ${made}/gapfarm.fish COMPONENT gapfarm
        DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
install(FILES ${made}/gapfarm-run@.service DESTINATION ${units} COMPONENT gapfarm)
install(FILES ${made}/gapfarm-worker.service DESTINATION ${units} COMPONENT gapfarm-worker)

set(packages gapfarm gapfarm-worker)
if(GAPFARM_PYTHON)
  list(APPEND packages python3-gapfarm)
  install(DIRECTORY python/gapfarm DESTINATION lib/python3/dist-packages COMPONENT python3-gapfarm
          PATTERN __pycache__ EXCLUDE)
endif()
set(changed "${PROJECT_SOURCE_DIR}/CHANGELOG.md")
file(READ LICENSE licence)
string(REGEX REPLACE "\n" "\n " licence " ${licence}")
string(REGEX REPLACE "\n *\n" "\n .\n" licence "${licence}")
string(TIMESTAMP now "%a, %d %b %Y %H:%M:%S +0000" UTC)  # or SOURCE_DATE_EPOCH's
# As the history names them; a packager says -DCPACK_PACKAGE_CONTACT='Name <address>'.
set(CPACK_PACKAGE_CONTACT
    "Seed e90f7182 maintainers <maintainers@users.noreply.h-seed-e90f7182.example>" CACHE STRING
    "Maintainer in the packages: Name <address>")
foreach(package ${packages})
  set(folder ${made}/${package})
  file(MAKE_DIRECTORY ${folder})
  configure_file(scripts/debian/copyright.in ${folder}/copyright @ONLY)
  configure_file(scripts/debian/changelog.in ${folder}/changelog.Debian @ONLY)
  execute_process(COMMAND ${GZIP_PROGRAM} -9 -n -f ${folder}/changelog.Debian)
  execute_process(COMMAND ${GZIP_PROGRAM} -9 -n -c ${changed} OUTPUT_FILE ${folder}/changelog.gz)
  install(FILES ${folder}/copyright ${folder}/changelog.Debian.gz ${folder}/changelog.gz
          DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${package})
endforeach()
# /etc is not below a prefix; a package owns it, `cmake --install` leaves it alone.
install(FILES scripts/debian/worker.env DESTINATION /etc/gapfarm COMPONENT gapfarm-worker
        EXCLUDE_FROM_ALL)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME gapfarm)
set(CPACK_PACKAGE_VENDOR gapfarm)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_COMPONENTS_ALL ${packages})
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(same "(= ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})")
set(CPACK_DEBIAN_GAPFARM_PACKAGE_NAME gapfarm)
set(CPACK_DEBIAN_GAPFARM_PACKAGE_DEPENDS "gapfarm-worker ${same}")  # a run takes one build
set(CPACK_DEBIAN_GAPFARM_DESCRIPTION
"Simulations are tuned, on as many machines as there are, until a simulated
robot moves like the real one; what is still missing from the simulation is
named, and a model is left that predicts motion with its uncertainty.

This package holds the master, which every command of the user is.")
set(CPACK_DEBIAN_GAPFARM-WORKER_PACKAGE_NAME gapfarm-worker)
set(CPACK_DEBIAN_GAPFARM-WORKER_PACKAGE_DEPENDS "adduser")
set(CPACK_DEBIAN_GAPFARM-WORKER_DESCRIPTION
"Simulations are tuned, on as many machines as there are, until a simulated
robot moves like the real one.

This package holds the program that simulates, and a service that works for
the master that /etc/gapfarm/worker.env names.")
set(CPACK_DEBIAN_PYTHON3-GAPFARM_PACKAGE_NAME python3-gapfarm)
set(CPACK_DEBIAN_PYTHON3-GAPFARM_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON3-GAPFARM_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_PYTHON3-GAPFARM_PACKAGE_DEPENDS
    "gapfarm ${same}, python3:any, python3-numpy, python3-pandas")
set(CPACK_DEBIAN_PYTHON3-GAPFARM_DESCRIPTION
"Simulations are tuned, on as many machines as there are, until a simulated
robot moves like the real one.

This package reads runs, models, diagnoses and logs into pandas, and asks the
programs for predictions and simulated logs.")
set(control ${PROJECT_SOURCE_DIR}/scripts/debian)
set(CPACK_DEBIAN_GAPFARM_PACKAGE_CONTROL_EXTRA ${control}/gapfarm/postinst)
set(CPACK_DEBIAN_GAPFARM-WORKER_PACKAGE_CONTROL_EXTRA
    ${control}/worker/postinst ${control}/worker/prerm ${control}/worker/postrm
    ${control}/worker/conffiles)
include(CPack)
