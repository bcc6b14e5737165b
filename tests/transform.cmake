fathom_test(transform_oracle transform_oracle.c cases.c)
