# The painting program, in a window on a virtual screen and without one.

if(TARGET fathom_paint)
    fathom_test(app_parts app_parts.c)
    target_link_libraries(test_app_parts PRIVATE fathom_paint_parts)
    fathom_script_test(app_auto app_auto.sh $<TARGET_FILE:fathom_paint>)
    foreach(name app app_options app_mesh)
        fathom_script_test(${name} ${name}.sh $<TARGET_FILE:fathom_paint>)
    endforeach()
    # The picture goes through the host where the CPU makes it.
    fathom_script_test(app_cpu app.sh $<TARGET_FILE:fathom_paint>)
    set_tests_properties(app_cpu PROPERTIES ENVIRONMENT APP_BACKEND=cpu)
endif()
