! SPDX-License-Identifier: MIT
!> What a build by fpm is: version, compiler, libraries (CMake fills in src/base/version.f90.in).
#define FIRST(X) '&
#define SECOND(X) &X'
module rockdda_base_version
   use, intrinsic :: iso_fortran_env, only : compiler_version, compiler_options
   implicit none
   private
   public :: version, build_description

   !> Version of the library, "1.2.3", from fpm.toml.
   character(len=*), parameter :: version = FIRST(ROCKDDA_VERSION)
      SECOND(ROCKDDA_VERSION)

contains

   !> Version, compiler, flags, options and libraries: five lines.
   pure function build_description() result(text)
      character(len=:), allocatable :: text
      character(len=1), parameter :: nl = new_line('a')
      text = 'rockdda '//version//nl &
             //'compiler:  '//compiler_version()//nl &
             //'flags:     '//compiler_options()//nl &
             //'options:   ROCKDDA_WITH_OPENMP=ON, ROCKDDA_WITH_CHOLMOD=ON'//nl &
             //'libraries: those that fpm found'
   end function build_description

end module rockdda_base_version
