! SPDX-License-Identifier: MIT
!> The viewer of `rockdda run --watch`: `rockdda-post view` of the results, beside the run and after it.
module rockdda_app_viewer
   use, intrinsic :: iso_c_binding, only : c_char, c_int, c_null_char
   use rockdda_app_process, only : print_error
   implicit none
   private
   public :: viewer_type

   type :: viewer_type
      integer(c_int), private :: process = -1
   contains
      procedure :: open => open_viewer
      procedure :: wait => wait_for_viewer
   end type viewer_type

   interface
      integer(c_int) function c_start(name, path) bind(C, name='rockdda_viewer_start')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: name(*), path(*)
      end function c_start
      subroutine c_wait(process) bind(C, name='rockdda_viewer_wait')
         import :: c_int
         integer(c_int), value :: process
      end subroutine c_wait
   end interface

contains

   !> Start the viewer of a results file that exists. Without the viewer the run goes on, with a warning.
   subroutine open_viewer(self, path)
      class(viewer_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      self%process = c_start('rockdda-post'//c_null_char, path//c_null_char)
      if (self%process < 0) call print_error('rockdda: warning: --watch: rockdda-post lies neither beside rockdda '// &
                                             'nor on the PATH; the run goes on without a viewer')
   end subroutine open_viewer

   !> Wait until the user has ended the viewer, where there is one.
   subroutine wait_for_viewer(self)
      class(viewer_type), intent(inout) :: self
      if (self%process < 0) return
      call print_error('rockdda: the viewer goes on until Ctrl-C')
      call c_wait(self%process)
      self%process = -1
   end subroutine wait_for_viewer

end module rockdda_app_viewer
