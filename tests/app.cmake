# The painting program, in a window on a virtual screen and without one.

if(TARGET fathom_paint)
    fathom_script_test(app_auto app_auto.sh $<TARGET_FILE:fathom_paint>)
    foreach(name app app_options)
        fathom_script_test(${name} ${name}.sh $<TARGET_FILE:fathom_paint>)
    endforeach()
endif()
